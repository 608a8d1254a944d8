/* Calls of FMI's functions, made one after the other until one has more to say than that it is done.
 *
 * A Python master makes them by a row each (`Row` in call.py), in memory that both see; what Python
 * alone can make stops the list, and is made there.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { BY_PYTHON, GATHER, PASS2, PASS3, STEP2, STEP3 }; /* as `By` in call.py */
enum { NOT_MADE = -1 };

typedef struct {
    int32_t kind;
    int32_t is_final;        /* of a step: nobody goes back to before it */
    void (*function)(void);  /* of the FMU */
    void *instance;
    const void *places;      /* value references; of a gather, which of `from` */
    size_t count;            /* of them */
    void *values;            /* where they come from or go to */
    size_t size;             /* how many, which FMI 3 asks for */
    const double *from;      /* of a gather */
    const double *span;      /* of a step: beginning and length, s */
    uint8_t *flags;          /* of FMI 3: event, end, early return; and one of the master's */
    double *last;            /* of FMI 3: where the step ended, s */
    double time;             /* where the FMU is, s */
} Row;

typedef int Pass2(void *, const void *, size_t, void *);
typedef int Pass3(void *, const void *, size_t, void *, size_t);
typedef int Step2(void *, double, double, int);
typedef int Step3(void *, double, double, bool, bool *, bool *, bool *, double *);

static int gather(const Row *r)
{
    const int64_t *places = r->places;
    double *values = r->values;
    for (size_t i = 0; i < r->count; i++) values[i] = r->from[places[i]];
    return 0;
}

static int step3(const Row *r)
{
    bool *flags = (bool *)r->flags;
    return ((Step3 *)r->function)(r->instance, r->span[0], r->span[1], r->is_final != 0, flags,
                                  flags + 1, flags + 2, r->last);
}

static int make(const Row *r)
{
    switch (r->kind) {
    case GATHER: return gather(r);
    case PASS2: return ((Pass2 *)r->function)(r->instance, r->places, r->count, r->values);
    case PASS3: return ((Pass3 *)r->function)(r->instance, r->places, r->count, r->values, r->size);
    case STEP2:
        return ((Step2 *)r->function)(r->instance, r->span[0], r->span[1], (int)r->is_final);
    case STEP3: return step3(r);
    default: return NOT_MADE;
    }
}

static bool asks(const Row *r)
{
    const uint8_t *f = r->flags;
    return r->kind == STEP3 && (f[0] || f[1] || f[2] || f[3]);
}

/* Make calls from number `at` on; gives the number of the one that stopped it, and its status; `n`
 * if none did. */
EXPORT size_t railcosim_make(Row *const rows[], size_t n, size_t at, int32_t *status)
{
    for (; at < n; at++) {
        Row *r = rows[at];
        *status = make(r);
        if (*status || asks(r)) break;
        if (r->span) r->time = r->span[0] + r->span[1];
    }
    return at;
}
