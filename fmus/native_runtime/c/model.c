#include "model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_WHOLE = 1 << 30 }; /* of what becomes an int */
enum { MOST_SEEN = 1 << 12, MOST_GAPS = 256 }; /* rows */
/* As in stepping_variables.py. */
static const double LEAST_INTERNAL_STEP = 1e-7; /* s: it bounds work */
static const double LEAST_SPEED = 0.1;          /* m/s, at which wheels creep */

typedef struct {
    Model *model;
    char *why;
    size_t room;
    int good; /* stays 0 once something was wrong */
} Reader;

static const void *section(Reader *reader, const char *name, ElementType type, size_t a, size_t b,
                           size_t c)
{
    const size_t dims[RESOURCE_MAX_DIMS] = {a, b, c};
    const void *data = reader->good ? resource_find(&reader->model->resource, name, type, dims,
                                                    reader->why, reader->room)
                                    : NULL;
    reader->good = data != NULL;
    return data;
}

/* Numbers of a section, all of them finite. */
static const double *doubles(Reader *reader, const char *name, size_t a, size_t b, size_t c)
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

static Complexes complexes(Reader *reader, const char *name, size_t a, size_t b, size_t c)
{
    char full[RESOURCE_NAME_SIZE + 4];
    Complexes z;
    snprintf(full, sizeof full, "%s.re", name);
    z.re = doubles(reader, full, a, b, c);
    snprintf(full, sizeof full, "%s.im", name);
    z.im = doubles(reader, full, a, b, c);
    return z;
}

static void demand(Reader *reader, int condition, const char *what)
{
    if (reader->good && !condition) {
        snprintf(reader->why, reader->room, "makes no sense: %s", what);
        reader->good = 0;
    }
}

static void *allocate(Reader *reader, size_t count, size_t size)
{
    void *memory = reader->good ? memory_take(&reader->model->memory, count, size) : NULL;
    if (reader->good && memory == NULL) {
        snprintf(reader->why, reader->room,
                 "needs more memory than there is, or than a file of its size may take");
        reader->good = 0;
    }
    return memory;
}

static size_t whole_blocks(size_t n) { return (n + BLOCK - 1) / BLOCK * BLOCK; }

/* What meets the body: wheelsets, sides, directions. */
static void read_layout(Reader *reader)
{
    Model *m = reader->model;
    const int32_t *sizes = section(reader, "layout", TYPE_INT32, 4, 0, 0);
    if (!reader->good)
        return;
    demand(reader, sizes[0] >= 1 && sizes[0] <= MOST_WHEELSETS, "the number of wheelsets");
    demand(reader, sizes[1] == 1 || sizes[1] == 2, "the number of sides");
    demand(reader, sizes[2] >= 1 && sizes[2] <= MOST_DIRECTIONS, "the number of directions");
    demand(reader, sizes[3] == 0 ||
           (sizes[3] == 1 && sizes[1] == 2 && 2 * sizes[2] <= MOST_DIRECTIONS), "sides apart");
    if (!reader->good)
        return;
    m->wheelsets = (size_t)sizes[0];
    m->sides = (size_t)sizes[1];
    m->directions = (size_t)sizes[2];
    m->apart = sizes[3];
    m->motions = m->directions * (m->apart ? m->sides : 1);
    m->rows = m->wheelsets * m->motions;
    m->padded_rows = whole_blocks(m->rows);
    m->side_contacts = m->wheelsets * m->directions;
    m->contacts = m->sides * m->side_contacts;
    m->mirror = section(reader, "mirror", TYPE_INT32, m->directions, 0, 0);
    for (size_t d = 0; reader->good && d < m->directions; d++)
        demand(reader, m->mirror[d] == 1 || m->mirror[d] == -1, "how a direction is mirrored");
}

static void read_sizes(Reader *reader)
{
    Model *m = reader->model;
    const int32_t *sizes = section(reader, "sizes", TYPE_INT32, 10, 0, 0);
    if (!reader->good)
        return;
    for (int k = 0; k < 9; k++)
        demand(reader, sizes[k] >= 0 && sizes[k] < 1 << 20, "a size is negative or too large");
    demand(reader, sizes[9] >= -1 && sizes[9] <= 1, "the contact's sign");
    if (!reader->good)
        return;
    m->even = (size_t)sizes[0];
    m->odd = (size_t)sizes[1];
    m->local = (size_t)sizes[2];
    m->rigid = (size_t)sizes[3];
    m->coordinates = (size_t)sizes[4];
    m->nodes = (size_t)sizes[5];
    m->cells = (size_t)sizes[6];
    m->even_rigid = (size_t)sizes[7];
    m->even_coordinates = (size_t)sizes[8];
    m->contact_sign = sizes[9];
    m->ring = m->even + m->odd;
    m->seen.rows = resource_length(&m->resource, "seen.re");
    m->seen.own = resource_length(&m->resource, "seen_size");
    demand(reader, m->seen.rows < MOST_SEEN && m->seen.own < MOST_SEEN &&
           (m->seen.rows == 0) == (m->seen.own == 0) && (m->seen.rows == 0 || m->nodes > 0) &&
           (m->seen.rows == 0 || m->seen.own % m->seen.rows == 0), "what is seen of it");
    m->modes = m->ring + m->local + m->seen.own;
    m->states = 2 * (m->modes + m->rigid);
    demand(reader, m->even > 0, "there are no modes");
    demand(reader, !m->apart || (m->odd == 0 && m->nodes > 0), "modes of sides apart");
    demand(reader, m->contact_sign == 0 || m->directions == 1 ||
                       m->directions == (m->contact_sign > 0 ? WHEEL_DIRECTIONS : RAIL_DIRECTIONS),
           "directions of a contact inside");
    m->rolls = m->contact_sign != 0 && m->directions > 1;
    m->given = m->rolls ? ROLLING_GIVEN : m->directions;
    demand(reader, (m->nodes > 0) != (m->coordinates > 0), "neither a track nor a vehicle");
    demand(reader, m->nodes == 0 || (m->nodes > 1 && m->cells > 0 && m->rigid == 0),
           "track");
    demand(reader, m->nodes > 0 || (m->local == 0 && m->rigid > 0), "vehicle");
    demand(reader, m->even_rigid <= m->rigid && m->even_coordinates <= m->coordinates,
           "how many are even");
}

static void read_segments(Reader *reader)
{
    Model *m = reader->model;
    m->segments = resource_length(&m->resource, "segments");
    const int32_t *rows = section(reader, "segments", TYPE_INT32, m->segments, 4, 0);
    const double *mu = doubles(reader, "mu", m->segments, 0, 0);
    m->segment = allocate(reader, m->segments + 1, sizeof *m->segment);
    size_t next = 0;
    for (size_t k = 0; reader->good && k < m->segments; k++, rows += 4) {
        demand(reader, rows[0] >= 0 && rows[1] >= 0 && rows[2] > 0 && rows[3] > 0 &&
               rows[3] < 1 << m->motions, "a segment of modes");
        if (!reader->good)
            return;
        Segment s = {(size_t)rows[0], (size_t)rows[1], (size_t)rows[2], 0, 0, 0, 0,
                     (unsigned)rows[3], mu[k]};
        const size_t first = s.to < m->even ? 0 : m->even;
        const size_t end = s.to < m->even ? m->even : m->ring;
        /* One after the other, and even and odd modes apart. */
        demand(reader, s.to == next && s.size <= end - s.to && s.from >= first && s.from < end &&
               s.size <= end - s.from, "a segment of modes");
        m->segment[k] = s;
        next = s.to + s.size;
    }
    demand(reader, next == m->ring, "segments leave modes out");
    m->chunk = allocate(reader, m->segments + 1, sizeof *m->chunk);
    m->chunk_rows = allocate(reader, m->segments * m->padded_rows, sizeof *m->chunk_rows);
    if (!reader->good)
        return;
    m->segment[m->segments] = (Segment){m->ring, m->ring, m->modes - m->ring, 0, 0, m->segments,
                                        m->ring, 0, 0};
    demand(reader, model_find_chunks(m), "a segment of modes without a partner");
}

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

static void read_track(Reader *reader)
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

static void read_vehicle(Reader *reader)
{
    Model *m = reader->model;
    m->out = complexes(reader, "out", m->rows, m->ring, 0);
    m->in = complexes(reader, "in", m->rows, m->ring, 0);
    m->coordinate = complexes(reader, "coordinate", m->coordinates, m->ring, 0);
    m->start_s = complexes(reader, "start_s", m->wheelsets, m->ring, 0);
    m->rigid_shape = doubles(reader, "rigid", m->coordinates, m->rigid, 0);
    m->rigid_out = doubles(reader, "rigid_out", m->rows, m->rigid, 0);
    m->rigid_in = doubles(reader, "rigid_in", m->rows, m->rigid, 0);
    m->through = doubles(reader, "through", m->coordinates, m->rows, 0);
    m->start_r = doubles(reader, "start_r", m->wheelsets, m->rigid, 0);
    m->wheelset_x = doubles(reader, "wheelset_x", m->wheelsets, 0, 0);
}

static void read_profile(Reader *reader)
{
    RollingProfile *p = &reader->model->profile;
    p->rows = reader->model->rolls ? resource_length(&reader->model->resource, "profile") : 0;
    if (p->rows == 0)
        return;
    p->table = doubles(reader, "profile", p->rows, PROFILE_COLUMNS, 0);
    const double *numbers = doubles(reader, "profile.about", 5, 0, 0);
    if (!reader->good)
        return;
    p->reference = numbers[0];
    p->half_distance = numbers[1];
    p->first = numbers[2];
    p->step = numbers[3];
    p->shear_modulus = numbers[4];
    demand(reader, rolling_profile_ready(p), "the table of wheel and rail profiles");
}

/* Forces at the ports of what the body meets. */
static size_t forces_out(const Model *m)
{
    if (!m->rolls)
        return m->contact_sign == 0 ? 0 : m->contacts;
    return m->sides * m->wheelsets *
           (m->contact_sign > 0 ? RAIL_DIRECTIONS : WHEEL_DIRECTIONS);
}

/* How many owners (wheelsets, contacts, coordinates) a role may have. */
static size_t owners(const Model *m, int role)
{
    switch (role) {
    case ROLE_IN_POSITION: return m->nodes > 0 ? m->wheelsets : 0;
    case ROLE_OUT_POSITION: return m->nodes > 0 ? 0 : m->wheelsets;
    case ROLE_START_Z: return m->wheelsets;
    case ROLE_OUT_FORCE: return forces_out(m);
    case ROLE_IN_LOAD: case ROLE_IN_LOAD_LESS: return m->sides * m->wheelsets * m->given;
    case ROLE_OUT_CONTACT_Z: case ROLE_OUT_CONTACT_VZ: return m->contacts;
    case ROLE_OUT_COORDINATE: case ROLE_OUT_RATE: return m->coordinates;
    case ROLE_OUT_ACCELERATION: return m->coordinates;
    case ROLE_OUT_SEEN: return m->seen.outputs;
    case ROLE_IN_SPEED: return m->rolls ? 1 : 0;
    default: return law_number((Role)role) < LAW_NUMBERS ? m->wheelsets : 1;
    }
}

static int causality_of(int role)
{
    if (role == ROLE_TIME)
        return INDEPENDENT;
    if (role <= ROLE_IN_LOAD_LESS || role == ROLE_IN_SPEED)
        return INPUT;
    return role <= ROLE_OUT_ACCELERATION || role == ROLE_OUT_SEEN ? OUTPUT : PARAMETER;
}

static void read_variable(Reader *reader, size_t k, const int32_t row[4], const double range[3])
{
    Model *m = reader->model;
    Variable *v = &m->variable[k];
    const int role = row[2];
    demand(reader, row[0] >= REAL && row[0] <= BOOLEAN && (row[1] == 0 || row[1] == 1) &&
           role >= 0 && role < ROLES && row[3] >= 0, "a variable");
    demand(reader, reader->good && (size_t)row[3] < owners(m, role), "a variable's owner");
    if (!reader->good)
        return;
    v->type = (ValueType)row[0];
    v->tunable = row[1];
    v->role = (Role)role;
    v->causality = (Causality)causality_of(role);
    v->index = (size_t)row[3];
    demand(reader, v->type == REAL || v->causality == PARAMETER, "an input that is no Real");
    v->start = range[0];
    v->minimum = range[1];
    v->maximum = range[2];
    demand(reader, isfinite(v->start) && v->minimum <= v->start && v->start <= v->maximum,
           "a start value");
    demand(reader, v->type == REAL || fabs(v->start) <= MAX_WHOLE, "a start value");
    demand(reader, role != ROLE_INTERNAL_STEP || v->minimum >= LEAST_INTERNAL_STEP,
           "the shortest internal step");
    demand(reader, role != ROLE_IN_SPEED || v->minimum >= LEAST_SPEED, "the lowest speed");
    if ((v->causality == PARAMETER && role != ROLE_START_Z) || role == ROLE_IN_SPEED)
        m->of_role[role] = (uint32_t)k;
    if (law_number(v->role) < LAW_NUMBERS)
        m->law[law_number(v->role) * m->wheelsets + v->index] = (uint32_t)k;
    if (v->causality == INPUT) {
        v->place = m->inputs;
        m->input[m->inputs++] = (uint32_t)k;
    }
    if (v->causality == OUTPUT)
        m->output[m->outputs++] = (uint32_t)k;
}

/* Whether the law asks for such a number: of profiles the table tells all but
   friction and what turns. */
static int in_law(const Model *m, size_t which)
{
    return m->profile.rows == 0 || which == law_number(ROLE_FRICTION) ||
           which == law_number(ROLE_AXLE_INERTIA);
}

/* One number is of all wheelsets, else there must be one of each. */
static void share_law(Reader *reader)
{
    const Model *m = reader->model;
    const size_t first = m->rolls ? law_number(ROLE_HERTZ) : law_number(ROLE_STIFFNESS);
    const size_t end = m->contact_sign == 0 ? 0 : m->rolls ? LAW_NUMBERS : 2;
    for (size_t which = first; reader->good && which < end; which++) {
        if (!in_law(m, which))
            continue;
        uint32_t *law = m->law + which * m->wheelsets;
        size_t given = 0;
        for (size_t k = 0; k < m->wheelsets; k++)
            given += law[k] != UINT32_MAX;
        demand(reader, given == m->wheelsets || (given == 1 && law[0] != UINT32_MAX),
               "a wheelset without a contact law");
        for (size_t k = 1; given == 1 && k < m->wheelsets; k++)
            law[k] = law[0];
    }
}

/* Whether there must be a parameter; those of the law are looked for by share_law. */
static int is_needed(const Model *m, int role)
{
    switch (role) {
    case ROLE_HOLD: return 1;
    case ROLE_INTERNAL_STEP: return m->contact_sign != 0 || m->nodes > 0;
    case ROLE_NONLINEAR: return m->contact_sign != 0 && !m->rolls;
    case ROLE_TEXTBOOK: return m->rolls && m->profile.rows == 0;
    case ROLE_SPEED: return m->coordinates > 0 && !m->rolls;
    case ROLE_IN_SPEED: return m->rolls;
    case ROLE_START_POSITION: return m->coordinates > 0;
    default: return 0;
    }
}

static void read_interface(Reader *reader)
{
    Model *m = reader->model;
    const size_t n = m->variables = resource_length(&m->resource, "variables");
    const size_t text = resource_length(&m->resource, "names");
    const int32_t *rows = section(reader, "variables", TYPE_INT32, n, 4, 0);
    const double *ranges = section(reader, "ranges", TYPE_DOUBLE, n, 3, 0);
    const char *names = section(reader, "names", TYPE_BYTE, text, 0, 0);
    m->variable = allocate(reader, n, sizeof *m->variable);
    m->input = allocate(reader, n, sizeof *m->input);
    m->output = allocate(reader, n, sizeof *m->output);
    m->law = allocate(reader, LAW_NUMBERS * m->wheelsets, sizeof *m->law);
    for (size_t k = 0; reader->good && k < LAW_NUMBERS * m->wheelsets; k++)
        m->law[k] = UINT32_MAX;
    for (int role = 0; role < ROLES; role++)
        m->of_role[role] = UINT32_MAX;
    demand(reader, reader->good && n < 1 << 16 && names[text - 1] == 0, "the interface");
    size_t at = 0;
    for (size_t k = 0; reader->good && k < n; k++) {
        demand(reader, at < text, "names are missing");
        if (!reader->good)
            return;
        m->variable[k].name = names + at;
        at += strlen(names + at) + 1;
        read_variable(reader, k, rows + 4 * k, ranges + 3 * k);
    }
    for (int role = ROLE_HOLD; reader->good && role < ROLES; role++)
        demand(reader, !is_needed(m, role) || m->of_role[role] != UINT32_MAX,
               "a parameter is missing");
    share_law(reader);
}

int model_load(Model *model, const char *path, char *why, size_t room)
{
    Resource resource;
    return resource_load(&resource, path, why, room) && model_read(model, resource, why, room);
}

int model_read(Model *model, Resource resource, char *why, size_t room)
{
    memset(model, 0, sizeof *model);
    model->resource = resource;
    model->memory = memory_for(resource.size);
    Reader reader = {model, why, room, 1};
    read_layout(&reader);
    read_sizes(&reader);
    if (reader.good) {
        model->preloads = doubles(&reader, "preloads", model->contacts, 0, 0);
        model->pole = complexes(&reader, "pole", model->modes, 0, 0);
        model->nominals = doubles(&reader, "nominals", model->rigid > 0 ? 4 : 2, 0, 0);
        read_segments(&reader);
        if (model->nodes > 0) {
            read_track(&reader);
            read_seen(&reader);
            read_gaps(&reader);
        } else {
            read_vehicle(&reader);
        }
        read_profile(&reader);
        read_interface(&reader);
        const size_t length = resource_length(&model->resource, "guid");
        model->guid = section(&reader, "guid", TYPE_BYTE, length, 0, 0);
        demand(&reader, reader.good && model->guid[length - 1] == 0, "the GUID");
    }
    for (size_t k = 0; reader.good && k < model->modes; k++) {
        /* Without dampers, rounding decides the sign of the real part; a vehicle without rails may
           topple. */
        const double size = fabs(model->pole.re[k]) + fabs(model->pole.im[k]);
        demand(&reader, size > 0 && (model->nodes == 0 || model->pole.re[k] <= 1e-9 * size),
               "a pole that is zero or grows");
    }
    if (!reader.good)
        model_free(model);
    return reader.good;
}

void model_free(Model *model)
{
    free(model->segment);
    free(model->chunk);
    free(model->chunk_rows);
    free(model->phase);
    free(model->table);
    free(model->stretch);
    free(model->seen.shown[0]);
    free(model->seen.shown[1]);
    free(model->variable);
    free(model->input);
    free(model->output);
    free(model->law);
    resource_free(&model->resource);
    memset(model, 0, sizeof *model);
}
