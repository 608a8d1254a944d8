/* Arrays of numbers in one block of memory, each at the beginning of a cache line. */
#ifndef RAILCOSIM_ARRAYS_H
#define RAILCOSIM_ARRAYS_H

#include "memory_rule.h"

#include <stdint.h>

enum { LINE = 8 }; /* numbers in one */

static inline size_t whole_lines(size_t n)
{
    return (n + LINE - 1) / LINE * LINE;
}

/* Laid out twice: first without memory, to find how much it takes. */
typedef struct {
    void *memory; /* to be freed */
    double *begin;
    size_t used;
} Arrays;

static inline double *arrays_take(Arrays *arrays, size_t n)
{
    double *part = arrays->begin == NULL ? NULL : arrays->begin + arrays->used;
    arrays->used += whole_lines(n);
    return part;
}

/* Memory for what has been laid out, all zeros; 0: there is none. */
static inline int arrays_make(Arrays *arrays, Memory *memory)
{
    const size_t bytes = LINE * sizeof(double);
    arrays->memory = memory_take(memory, arrays->used + LINE, sizeof(double));
    if (arrays->memory == NULL)
        return 0;
    const size_t over = (uintptr_t)arrays->memory % bytes;
    arrays->begin = (double *)((char *)arrays->memory + (over == 0 ? 0 : bytes - over));
    arrays->used = 0;
    return 1;
}

#endif
