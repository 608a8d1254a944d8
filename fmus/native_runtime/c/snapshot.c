#include "instance.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char MAGIC[8] = {'R', 'A', 'I', 'L', 'S', 'T', 'A', '1'};

/* What stands before the numbers of a snapshot, in memory and as bytes. */
typedef struct {
    char magic[8];
    char guid[48];
    uint64_t model_exchange, numbers, checksum;
} Stamp;

struct Snapshot {
    Stamp stamp;
    double live[]; /* stamp.numbers of them */
};

static uint64_t checksum(const double *live, size_t n)
{
    return crc32_of((const unsigned char *)live, n * sizeof(double));
}

/* What a snapshot holds: `live`, the state, and the state before. */
static size_t numbers_of(const Instance *i)
{
    return i->live_size + 2 * i->model.states;
}

/* The stamp of this instance's snapshots, but for the checksum. */
static Stamp stamp_of(const Instance *i)
{
    Stamp stamp;
    memset(&stamp, 0, sizeof stamp);
    memcpy(stamp.magic, MAGIC, sizeof MAGIC);
    snprintf(stamp.guid, sizeof stamp.guid, "%s", i->model.guid);
    stamp.model_exchange = (uint64_t)i->model_exchange;
    stamp.numbers = numbers_of(i);
    return stamp;
}

static int belongs(const Instance *i, const Stamp *stamp)
{
    Stamp own = stamp_of(i);
    own.checksum = stamp->checksum;
    return memcmp(&own, stamp, sizeof own) == 0;
}

Snapshot *snapshot_take(Instance *i, Snapshot *reused)
{
    if (reused != NULL && !belongs(i, &reused->stamp)) {
        instance_fail(i, "the state to be overwritten is not of this FMU");
        return NULL;
    }
    Snapshot *s = reused;
    if (s == NULL)
        s = malloc(sizeof *s + numbers_of(i) * sizeof(double));
    if (s == NULL) {
        instance_fail(i, "not enough memory for a snapshot");
        return NULL;
    }
    s->stamp = stamp_of(i);
    const size_t bytes = i->model.states * sizeof(double);
    memcpy(s->live, i->live, i->live_size * sizeof(double));
    memcpy(s->live + i->live_size, i->x, bytes);
    memcpy(s->live + i->live_size + i->model.states, i->x_before, bytes);
    return s;
}

Status snapshot_restore(Instance *i, const Snapshot *snapshot)
{
    if (snapshot == NULL || !belongs(i, &snapshot->stamp))
        return instance_fail(i, "this state is not of this FMU");
    const size_t bytes = i->model.states * sizeof(double);
    memcpy(i->live, snapshot->live, i->live_size * sizeof(double));
    memcpy(i->x, snapshot->live + i->live_size, bytes);
    memcpy(i->x_before, snapshot->live + i->live_size + i->model.states, bytes);
    motion_forget(&i->motion);
    return OK;
}

void snapshot_free(Snapshot *snapshot)
{
    free(snapshot);
}

size_t snapshot_size(const Snapshot *snapshot)
{
    return sizeof(Stamp) + snapshot->stamp.numbers * sizeof(double);
}

Status snapshot_write(Instance *i, const Snapshot *snapshot, unsigned char *bytes, size_t size)
{
    if (snapshot == NULL || !belongs(i, &snapshot->stamp) || size < snapshot_size(snapshot))
        return instance_fail(i, "this state is not of this FMU, or %lu bytes are too few for it",
                             (unsigned long)size);
    Stamp stamp = snapshot->stamp;
    stamp.checksum = checksum(snapshot->live, numbers_of(i));
    memcpy(bytes, &stamp, sizeof stamp);
    memcpy(bytes + sizeof stamp, snapshot->live, numbers_of(i) * sizeof(double));
    return OK;
}

/* A checksum finds damage, not malice: the phase and the parameters become whole numbers. */
static int makes_sense(const Instance *i, const double *live)
{
    const double phase = ((const Clock *)live)->phase, *value = live + (i->value - i->live);
    int good = phase == STARTED || phase == INITIALISING || phase == EVENT ||
               phase == CONTINUOUS || phase == STEPPING || phase == TERMINATED;
    for (size_t k = 0; k < i->model.variables; k++) {
        const Variable *v = &i->model.variable[k];
        good &= v->causality != PARAMETER || (value[k] >= v->minimum && value[k] <= v->maximum);
    }
    return good;
}

Snapshot *snapshot_read(Instance *i, const unsigned char *bytes, size_t size)
{
    Stamp stamp;
    if (bytes == NULL || size != sizeof stamp + numbers_of(i) * sizeof(double)) {
        instance_fail(i, "%lu bytes are not a state of this FMU, which has %lu",
                      (unsigned long)size,
                      (unsigned long)(sizeof stamp + numbers_of(i) * sizeof(double)));
        return NULL;
    }
    memcpy(&stamp, bytes, sizeof stamp);
    if (!belongs(i, &stamp)) {
        instance_fail(i, "the bytes are the state of another FMU");
        return NULL;
    }
    Snapshot *s = malloc(sizeof *s + numbers_of(i) * sizeof(double));
    if (s == NULL) {
        instance_fail(i, "not enough memory for a snapshot");
        return NULL;
    }
    s->stamp = stamp;
    memcpy(s->live, bytes + sizeof stamp, numbers_of(i) * sizeof(double));
    if (stamp.checksum != checksum(s->live, numbers_of(i)) || !makes_sense(i, s->live)) {
        instance_fail(i, "the bytes of the state are damaged");
        snapshot_free(s);
        return NULL;
    }
    return s;
}
