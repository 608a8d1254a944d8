#include "model_reading.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_SEEN = 1 << 12 }; /* rows */

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

int model_load(Model *model, const char *path, char *why, size_t room)
{
    Resource resource;
    return resource_load(&resource, path, why, room) && model_read(model, resource, why, room);
}

/* Without dampers, rounding decides the sign of the real part; a vehicle without rails may topple. */
static void check_poles(Reader *reader)
{
    const Model *m = reader->model;
    for (size_t k = 0; reader->good && k < m->modes; k++) {
        const double size = fabs(m->pole.re[k]) + fabs(m->pole.im[k]);
        demand(reader, size > 0 && (m->nodes == 0 || m->pole.re[k] <= 1e-9 * size),
               "a pole that is zero or grows");
    }
}

static void read_modes(Reader *reader)
{
    Model *m = reader->model;
    m->preloads = doubles(reader, "preloads", m->contacts, 0, 0);
    m->pole = complexes(reader, "pole", m->modes, 0, 0);
    m->nominals = doubles(reader, "nominals", m->rigid > 0 ? 4 : 2, 0, 0);
    read_segments(reader);
}

static void read_guid(Reader *reader)
{
    Model *m = reader->model;
    const size_t length = resource_length(&m->resource, "guid");
    m->guid = section(reader, "guid", TYPE_BYTE, length, 0, 0);
    demand(reader, reader->good && m->guid[length - 1] == 0, "the GUID");
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
        read_modes(&reader);
        if (model->nodes > 0)
            model_read_track(&reader);
        else
            read_vehicle(&reader);
        read_profile(&reader);
        model_read_interface(&reader);
        read_guid(&reader);
        check_poles(&reader);
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
