/* libFuzzer on the reader of model.bin, and on everything that is done with a file it accepts.
   Compiled with RAILCOSIM_FUZZING, which leaves the checksum out: no fuzzer would get past it. */
#define _GNU_SOURCE /* memfd_create */
#include "instance.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { SIZE_AT = 8, HEAD = 32 };

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size);

static unsigned long accepted;

static void say_how_many(void) { fprintf(stderr, "accepted: %lu\n", accepted); }

static void silent(void *context, Status status, const char *text)
{
    (void)context;
    (void)status;
    if (text[0] == 0)
        __builtin_trap(); /* every failure has a sentence */
}

/* A file in memory with these bytes; its head says its true size, which is easy to get right. */
static int file_of(const unsigned char *bytes, size_t size, char *path, size_t room)
{
    const int file = memfd_create("model", 0);
    const uint64_t true_size = size;
    if (file < 0 || write(file, bytes, size) != (ssize_t)size)
        __builtin_trap();
    if (size >= HEAD && pwrite(file, &true_size, sizeof true_size, SIZE_AT) < 0)
        __builtin_trap();
    snprintf(path, room, "/proc/self/fd/%d", file);
    return file;
}

static void use(Instance *i)
{
    const Model *m = &i->model;
    double value = 0, ten[16] = {0};
    for (uint32_t ref = 0; ref < m->variables; ref++)
        instance_get(i, &ref, 1, m->variable[ref].type, &value);
    if (i->model_exchange && m->states <= 16)
        instance_derivatives(i, ten, m->states);
    if (m->inputs > 0 && m->outputs > 0) {
        const uint32_t in = m->input[m->inputs - 1], out = m->output[0];
        const double seed = 1;
        instance_directional(i, &out, 1, &in, 1, &seed, &value);
        instance_output_slopes(i, &out, 1, &value);
    }
}

static void live(const char *path, const char *guid, int model_exchange)
{
    Instance *i = instance_new(path, guid, model_exchange, silent, NULL);
    if (i == NULL)
        return;
    use(i);
    instance_set_time(i, 0);
    instance_enter(i, INITIALISING);
    use(i);
    if (instance_exit_initialisation(i) == OK) {
        Snapshot *snapshot = snapshot_take(i, NULL);
        for (int k = 0; k < 3 && !model_exchange; k++) {
            for (size_t j = 0; j < i->model.inputs; j++) {
                const double value = 1.5 * k + 0.1 * (double)j;
                instance_set(i, &i->model.input[j], 1, REAL, &value);
            }
            instance_step(i, 1e-3 * k, 1e-3);
            use(i);
        }
        if (snapshot != NULL)
            snapshot_restore(i, snapshot);
        use(i);
        snapshot_free(snapshot);
    }
    instance_free(i);
}

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size)
{
    char path[64], why[256] = "", guid[256] = "";
    static int first = 1;
    Model model;
    if (first)
        atexit(say_how_many);
    first = 0;
    const int file = file_of(bytes, size, path, sizeof path);
    if (model_load(&model, path, why, sizeof why)) {
        snprintf(guid, sizeof guid, "%s", model.guid);
        model_free(&model);
        accepted++;
        live(path, guid, 0);
        live(path, guid, 1);
    } else if (why[0] == 0) {
        __builtin_trap();
    }
    close(file);
    return 0;
}
