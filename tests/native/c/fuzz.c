/* libFuzzer on the reader of model.bin, and on everything that is done with a file it accepts.
   Compiled with RAILCOSIM_FUZZING, which leaves the checksum out: no fuzzer would get past it.

   Memory is counted here, byte by byte: what libFuzzer holds against a limit is the largest size that
   the process ever had, and a process begins with that of whoever started it (getrusage(2)). */
#define _GNU_SOURCE /* memfd_create */
#include "instance.h"

#include <limits.h>
#include <sanitizer/allocator_interface.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { SIZE_AT = 8, HEAD = 32, MOST_VARIABLES = 1 << 16 };

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size);

static const double STEP = 2e-4; /* s: two internal ones */
static unsigned long accepted;
/* Bytes, of the file that is looked at: held now, that may be, and that ever were of any file. */
static long long held, limit = LLONG_MAX, most;

static void say_how_many(void)
{
    fprintf(stderr, "accepted: %lu\nmost_bytes: %lld\n", accepted, most);
}

static void taken(const volatile void *memory, size_t size)
{
    (void)memory;
    held += (long long)size;
    most = held > most ? held : most;
    if (held > limit)
        __builtin_trap();
}

static void given_back(const volatile void *memory)
{
    if (memory != NULL)
        held -= (long long)__sanitizer_get_allocated_size(memory);
}

/* By the rule for an instance; and the file itself, and a snapshot of less than an instance. */
static void count_from_now(size_t file_size)
{
    held = 0;
    limit = (long long)(file_size + 2 * memory_for(file_size).left);
}

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
    static uint32_t refs[MOST_VARIABLES];
    static double values[MOST_VARIABLES];
    double value = 0, ten[16] = {0};
    for (ValueType type = REAL; type <= BOOLEAN; type++) {
        size_t n = 0;
        for (uint32_t ref = 0; ref < m->variables; ref++)
            if (m->variable[ref].type == type)
                refs[n++] = ref;
        instance_get(i, refs, n, type, values); /* at once: each call that fails tries again */
    }
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
                const uint32_t in = i->model.input[j];
                /* Little by little, and at last far away. */
                const double by = k < 2 ? 1e-5 * (double)(k + j % 3) : 1.5 + 0.1 * (double)j;
                const double value = i->model.variable[in].start + by;
                instance_set(i, &in, 1, REAL, &value);
            }
            if (instance_step(i, STEP * k, STEP) != OK)
                break; /* whatever is asked now is tried 200 times in vain */
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
    if (first) {
        atexit(say_how_many);
        __sanitizer_install_malloc_and_free_hooks(taken, given_back);
    }
    first = 0;
    count_from_now(size);
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
    limit = LLONG_MAX;
    close(file);
    return 0;
}
