#include "arrays.h"
#include "model.h"

#include <string.h>

enum { LEAST = 96 }; /* modes of a chunk, where there are more */

/* The segment that begins at a mode; `segments` if none does. */
static size_t segment_at(const Model *m, size_t to)
{
    size_t low = 0, high = m->segments;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (m->segment[middle].to < to)
            low = middle + 1;
        else
            high = middle;
    }
    return low < m->segments && m->segment[low].to == to ? low : m->segments;
}

static int same_poles(const Model *m, const Segment *a, const Segment *b)
{
    const size_t bytes = a->size * sizeof(double);
    return memcmp(m->pole.re + a->to, m->pole.re + b->to, bytes) == 0 &&
           memcmp(m->pole.im + a->to, m->pole.im + b->to, bytes) == 0;
}

static int find_partners(Model *m)
{
    for (size_t j = 0; j < m->segments; j++) {
        Segment *s = &m->segment[j];
        s->partner = segment_at(m, s->from);
        if (s->partner == m->segments)
            return 0;
        const Segment *other = &m->segment[s->partner];
        if (other->from != s->to || other->size != s->size || !same_poles(m, s, other))
            return 0;
        s->pole = other->to < s->to ? other->to : s->to;
    }
    return 1;
}

/* The next chunk, from segment `first` on. */
static Chunk chunk_from(const Model *m, size_t first)
{
    const size_t to = m->segment[first].to;
    Chunk chunk = {first, first, to, m->width, 0, 0, to >= m->even};
    size_t reach = first; /* the last one that a partner in the chunk needs in it */
    for (size_t j = first; j < m->segments && (j <= reach || chunk.size < LEAST); j++) {
        if ((m->segment[j].to >= m->even) != chunk.odd)
            break;
        reach = m->segment[j].partner > reach ? m->segment[j].partner : reach;
        chunk.size += m->segment[j].size;
        chunk.end = j + 1;
    }
    chunk.room = whole_lines(chunk.size + LINE - 1); /* segments are evaluated in whole lines */
    return chunk;
}

int model_find_chunks(Model *m)
{
    if (!find_partners(m))
        return 0;
    for (size_t j = 0; j < m->segments; j = m->chunk[m->chunks - 1].end) {
        const Chunk chunk = chunk_from(m, j);
        for (size_t k = j; k < chunk.end; k++)
            m->segment[k].out = chunk.at + m->segment[k].to - chunk.to;
        m->chunk[m->chunks++] = chunk;
        m->width += chunk.room;
    }
    for (size_t j = 0; j < m->segments; j++)
        m->segment[j].in = m->segment[m->segment[j].partner].out;
    Segment *local = &m->segment[m->segments];
    local->out = local->in = m->width;
    m->chunk[m->chunks] = (Chunk){m->segments, m->segments + 1, m->ring, m->width,
                                  m->local, whole_lines(m->local), 0};
    m->drives = m->width + whole_lines(m->local);
    return 1;
}

void model_fill_table(Model *m, const float *re, const float *im)
{
    const float *const parts[2] = {re, im};
    for (size_t j = 0; j < m->chunks; j++) {
        const Chunk *chunk = &m->chunk[j];
        float *to = m->table + NODE_PARTS * m->directions * m->nodes * chunk->at;
        for (size_t row = 0; row < 2 * m->nodes * m->directions; row++)
            for (int part = 0; part < 2; part++, to += chunk->room)
                memcpy(to, parts[part] + row * m->ring + chunk->to, chunk->size * sizeof(float));
    }
}
