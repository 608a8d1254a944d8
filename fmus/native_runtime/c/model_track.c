/* Reading of what a track has and a vehicle has not: shapes along its ring, what is seen of it at fixed
   places, springs with gaps. */
#include "model_reading.h"

enum { MOST_GAPS = 256 };

/* One part of the table of shapes. */
static const float *floats(Reader *reader, const char *name)
{
    const Model *m = reader->model;
    const size_t values = 2 * m->motions;
    const float *data = section(reader, name, TYPE_FLOAT, m->nodes, values, m->ring);
    for (size_t k = 0; data != NULL && k < values * m->nodes * m->ring; k++)
        if (!isfinite(data[k])) {
            demand(reader, 0, "a mode shape is not finite");
            return NULL;
        }
    return data;
}

/* Where elements begin, and what is between their nodes of the local modes. */
static void read_local(Reader *reader)
{
    Model *m = reader->model;
    m->elements = resource_length(&m->resource, "elements");
    m->begins = section(reader, "elements", TYPE_INT32, m->elements, 0, 0);
    demand(reader, m->elements >= 1 && m->elements <= m->nodes, "the number of elements");
    for (size_t k = 0; reader->good && k < m->elements; k++)
        demand(reader, m->begins[k] >= (k ? m->begins[k - 1] + 1 : 0) &&
               (size_t)m->begins[k] < m->nodes, "where an element begins");
    const int32_t *parts = section(reader, "parts", TYPE_INT32, 1, 0, 0);
    demand(reader, parts != NULL && *parts >= 1 && *parts <= MOST_PARTS, "the parts of an element");
    if (!reader->good)
        return;
    m->parts = (size_t)*parts;
    m->local_shape = complexes(reader, "local", 2 * m->nodes * m->parts, m->motions, m->directions);
}

/* Where elements of another length begin. */
static void read_stretches(Reader *reader)
{
    Model *m = reader->model;
    const size_t count = resource_length(&m->resource, "stretches");
    const double *rows = doubles(reader, "stretches", count, 2, 0);
    m->stretch = allocate(reader, count, sizeof *m->stretch);
    demand(reader, count >= 1 && count <= m->elements, "stretches of elements");
    for (size_t k = 0; reader->good && k < count; k++) {
        const int last = k + 1 == count;
        const double *row = rows + 2 * k, begin = row[0], first = row[1];
        const double end = last ? m->cell_length : row[2];
        const double next = last ? (double)m->elements : row[3];
        demand(reader, (k > 0 || (begin == 0 && first == 0)) && end - begin > 1e-3 &&
               next - first >= 1 && next <= (double)m->elements && floor(next) == next,
               "stretches of elements");
        if (reader->good)
            m->stretch[k] = (Stretch){begin, last ? INFINITY : end, (end - begin) / (next - first),
                                      (size_t)first, (size_t)(next - first)};
    }
}

static void read_ring(Reader *reader)
{
    Model *m = reader->model;
    const float *re = floats(reader, "table.re"), *im = floats(reader, "table.im");
    /* What is of local modes begins behind the table. */
    m->table = allocate(reader, reader->good ? m->chunk[m->chunks].table : 0, sizeof(float));
    if (reader->good)
        model_fill_table(m, re, im);
    read_local(reader);
    const double *geometry = doubles(reader, "geometry", 1, 0, 0);
    demand(reader, m->local == m->contacts, "local modes must be one a contact");
    if (!reader->good)
        return;
    m->cell_length = geometry[0];
    demand(reader, m->cell_length > 1e-3 && m->cell_length < 1e6, "the geometry of the cell");
    m->length = m->cell_length * (double)m->cells;
    read_stretches(reader);
    m->phase = allocate(reader, 2 * m->cells * m->segments, sizeof(double));
    for (size_t c = 0; reader->good && c < m->cells; c++)
        for (size_t k = 0; k < m->segments; k++) {
            m->phase[2 * (c * m->segments + k)] = cos((double)c * m->segment[k].mu);
            m->phase[2 * (c * m->segments + k) + 1] = sin((double)c * m->segment[k].mu);
        }
}

/* What is seen at fixed places. */
static void read_seen(Reader *reader)
{
    Model *m = reader->model;
    Observed *seen = &m->seen;
    seen->padded_rows = whole_blocks(seen->rows);
    if (seen->rows == 0)
        return;
    const Complexes shown = complexes(reader, "seen", seen->rows, m->ring, 0);
    seen->places = reader->good ? resource_second(&m->resource, "seen_into.re") : 0;
    demand(reader, seen->places > 1, "a table of what is seen");
    seen->into = complexes(reader, "seen_into", seen->own, seen->places, m->sides * m->directions);
    seen->size = doubles(reader, "seen_size", seen->own, 0, 0);
    seen->begin = doubles(reader, "seen_begin", seen->own, 0, 0);
    const double *spacing = doubles(reader, "seen_spacing", 1, 0, 0);
    seen->outputs = resource_length(&m->resource, "seen_row");
    seen->row = section(reader, "seen_row", TYPE_INT32, seen->outputs, 0, 0);
    seen->weight = doubles(reader, "seen_weight", seen->outputs, 3, 0);
    for (int part = 0; part < 2; part++)
        seen->shown[part] = allocate(reader, seen->padded_rows * m->ring, sizeof(double));
    if (!reader->good)
        return;
    seen->spacing = spacing[0];
    demand(reader, seen->spacing > 1e-6 &&
           seen->spacing * (double)(seen->places - 1) < m->length, "places of what is seen");
    for (size_t k = 0; reader->good && k < seen->outputs; k++) {
        demand(reader, seen->row[k] >= 0 && (size_t)seen->row[k] < seen->rows,
               "a row of what is seen");
        seen->rates |= seen->weight[3 * k + 1] != 0 || seen->weight[3 * k + 2] != 0;
    }
    if (reader->good)
        model_fill_seen(m, shown.re, shown.im);
}

static void read_gaps(Reader *reader)
{
    Model *m = reader->model;
    ModelGaps *gaps = &m->gaps;
    gaps->count = resource_length(&m->resource, "gap");
    if (gaps->count == 0)
        return;
    demand(reader, gaps->count <= MOST_GAPS, "the number of gaps");
    gaps->shown = complexes(reader, "gap_shown", gaps->count, m->ring, 0);
    gaps->stiffness = doubles(reader, "gap_stiffness", gaps->count, 0, 0);
    gaps->damping = doubles(reader, "gap_damping", gaps->count, 0, 0);
    gaps->gap = doubles(reader, "gap", gaps->count, 0, 0);
    for (size_t k = 0; reader->good && k < gaps->count; k++)
        demand(reader, gaps->stiffness[k] > 0 && gaps->damping[k] >= 0 && gaps->gap[k] >= 0,
               "a spring with a gap");
}

void model_read_track(Reader *reader)
{
    read_ring(reader);
    read_seen(reader);
    read_gaps(reader);
}
