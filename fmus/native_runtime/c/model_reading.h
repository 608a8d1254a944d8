/* How a model is read from its resource: what all parts of reading (model*.c) use. The first thing
   that is wrong is told in `why`; after it nothing more is taken, and all that is asked for is NULL. */
#ifndef RAILCOSIM_MODEL_READING_H
#define RAILCOSIM_MODEL_READING_H

#include "model.h"

#include <math.h>
#include <stdio.h>

typedef struct {
    Model *model;
    char *why;
    size_t room;
    int good; /* stays 0 once something was wrong */
} Reader;

static inline const void *section(Reader *reader, const char *name, ElementType type, size_t a,
                                  size_t b, size_t c)
{
    const size_t dims[RESOURCE_MAX_DIMS] = {a, b, c};
    const void *data = reader->good ? resource_find(&reader->model->resource, name, type, dims,
                                                    reader->why, reader->room)
                                    : NULL;
    reader->good = data != NULL;
    return data;
}

/* Numbers of a section, all of them finite. */
static inline const double *doubles(Reader *reader, const char *name, size_t a, size_t b,
                                    size_t c)
{
    const double *data = section(reader, name, TYPE_DOUBLE, a, b, c);
    const size_t count = a * (b ? b : 1) * (c ? c : 1);
    for (size_t k = 0; data != NULL && k < count; k++)
        if (!isfinite(data[k])) {
            snprintf(reader->why, reader->room, "has a number in '%s' that is not finite", name);
            reader->good = 0;
            return NULL;
        }
    return data;
}

static inline Complexes complexes(Reader *reader, const char *name, size_t a, size_t b, size_t c)
{
    char full[RESOURCE_NAME_SIZE + 4];
    Complexes z;
    snprintf(full, sizeof full, "%s.re", name);
    z.re = doubles(reader, full, a, b, c);
    snprintf(full, sizeof full, "%s.im", name);
    z.im = doubles(reader, full, a, b, c);
    return z;
}

static inline void demand(Reader *reader, int condition, const char *what)
{
    if (reader->good && !condition) {
        snprintf(reader->why, reader->room, "makes no sense: %s", what);
        reader->good = 0;
    }
}

static inline void *allocate(Reader *reader, size_t count, size_t size)
{
    void *memory = reader->good ? memory_take(&reader->model->memory, count, size) : NULL;
    if (reader->good && memory == NULL) {
        snprintf(reader->why, reader->room,
                 "needs more memory than there is, or than a file of its size may take");
        reader->good = 0;
    }
    return memory;
}

static inline size_t whole_blocks(size_t n) { return (n + BLOCK - 1) / BLOCK * BLOCK; }

/* Parts of reading that have files of their own. */
void model_read_track(Reader *reader);
void model_read_interface(Reader *reader);

#endif
