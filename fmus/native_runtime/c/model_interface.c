/* Reading of the interface: variables, whose they are, and the numbers of contact laws among them. */
#include "model_reading.h"

#include <string.h>

enum { MAX_WHOLE = 1 << 30 }; /* of what becomes an int */
/* As in stepping_variables.py. */
static const double LEAST_INTERNAL_STEP = 1e-7; /* s: it bounds work */
static const double LEAST_SPEED = 0.1;          /* m/s, at which wheels creep */

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

/* Whether the law asks for such a number: of profiles the table tells all but friction and what
   turns. */
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
    case ROLE_FASTSIM: return m->rolls;
    case ROLE_TEXTBOOK: return m->rolls && m->profile.rows == 0;
    case ROLE_SPEED: return m->coordinates > 0 && !m->rolls;
    case ROLE_IN_SPEED: return m->rolls;
    case ROLE_START_POSITION: return m->coordinates > 0;
    default: return 0;
    }
}

void model_read_interface(Reader *reader)
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
