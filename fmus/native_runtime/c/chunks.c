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
        if (other->from != s->to || other->size != s->size || other->moves != s->moves ||
            !same_poles(m, s, other))
            return 0;
        s->pole = other->to < s->to ? other->to : s->to;
    }
    return 1;
}

/* The next chunk, from segment `first` on. */
static Chunk chunk_from(const Model *m, size_t first)
{
    const size_t to = m->segment[first].to;
    Chunk chunk = {0};
    chunk.first = chunk.end = first;
    chunk.to = to;
    chunk.at = m->width;
    chunk.odd = to >= m->even;
    size_t reach = first; /* the last one that a partner in the chunk needs in it */
    for (size_t j = first; j < m->segments && (j <= reach || chunk.size < LEAST); j++) {
        if ((m->segment[j].to >= m->even) != chunk.odd ||
            m->segment[j].moves != m->segment[first].moves)
            break;
        reach = m->segment[j].partner > reach ? m->segment[j].partner : reach;
        chunk.size += m->segment[j].size;
        chunk.end = j + 1;
    }
    chunk.room = whole_lines(chunk.size + LINE - 1); /* segments are evaluated in whole lines */
    return chunk;
}

/* Rows of a chunk, wheelset by wheelset, from where `row` has room. */
static void find_rows(const Model *m, Chunk *chunk, size_t *row)
{
    for (size_t d = 0; d < m->motions; d++)
        if (m->segment[chunk->first].moves >> d & 1)
            chunk->direction[chunk->moving++] = d;
    chunk->rows = m->wheelsets * chunk->moving;
    chunk->padded_rows = (chunk->rows + BLOCK - 1) / BLOCK * BLOCK;
    for (size_t k = 0; k < chunk->padded_rows; k++)
        row[k] = k < chunk->rows ? k / chunk->moving * m->motions +
                                       chunk->direction[k % chunk->moving]
                                 : m->padded_rows;
    chunk->row = row;
}

int model_find_chunks(Model *m)
{
    size_t table = 0, *row = m->chunk_rows;
    if (!find_partners(m))
        return 0;
    for (size_t j = 0; j < m->segments; j = m->chunk[m->chunks - 1].end) {
        Chunk chunk = chunk_from(m, j);
        for (size_t k = j; k < chunk.end; k++)
            m->segment[k].out = chunk.at + m->segment[k].to - chunk.to;
        find_rows(m, &chunk, row);
        row += chunk.padded_rows;
        chunk.shapes = m->shapes;
        chunk.table = table;
        m->shapes += chunk.padded_rows * chunk.room;
        table += NODE_PARTS * chunk.moving * m->nodes * chunk.room;
        m->chunk[m->chunks++] = chunk;
        m->width += chunk.room;
    }
    for (size_t j = 0; j < m->segments; j++)
        m->segment[j].in = m->segment[m->segment[j].partner].out;
    Segment *local = &m->segment[m->segments];
    local->out = local->in = m->width;
    m->chunk[m->chunks] = (Chunk){.first = m->segments, .end = m->segments + 1, .to = m->ring,
                                  .at = m->width, .size = m->modes - m->ring,
                                  .room = whole_lines(m->modes - m->ring),
                                  .shapes = m->shapes, .table = table};
    m->drives = m->width + m->chunk[m->chunks].room;
    return 1;
}

void model_fill_table(Model *m, const float *re, const float *im)
{
    const float *const parts[2] = {re, im};
    for (size_t j = 0; j < m->chunks; j++) {
        const Chunk *chunk = &m->chunk[j];
        float *to = m->table + chunk->table;
        for (size_t k = 0; k < m->nodes * chunk->moving; k++) {
            const size_t row = k / chunk->moving * m->motions +
                               chunk->direction[k % chunk->moving];
            for (int part = 0; part < NODE_PARTS; part++, to += chunk->room)
                memcpy(to, parts[part % 2] + (2 * row + (size_t)part / 2) * m->ring + chunk->to,
                       chunk->size * sizeof(float));
        }
    }
}
