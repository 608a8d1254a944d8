/* What an instance's parameters make of its body. */
#include "instance.h"
#include "rolling_law.h"

double instance_parameter(const Instance *i, Role role)
{
    const uint32_t ref = i->model.of_role[role];
    return ref == UINT32_MAX ? 0 : i->value[ref];
}

double instance_speed(const Instance *i)
{
    const uint32_t ref = i->model.of_role[ROLE_IN_SPEED];
    const int starting = (instance_phase(i) & (STARTED | INITIALISING)) != 0;
    if (ref == UINT32_MAX)
        return instance_parameter(i, ROLE_SPEED);
    return (starting ? i->shown : i->u_end)[i->model.variable[ref].place];
}

/* A number of the law of contact k. */
static double law_value(const Instance *i, Role role, size_t k)
{
    const size_t n = i->model.wheelsets;
    return i->value[i->model.law[law_number(role) * n + k % n]];
}

static RollingLaw rolling_law_of(const Instance *i, size_t k)
{
    const RollingProfile *profile = &i->model.profile;
    double number[ROLLING_NUMBERS] = {0};
    number[NUMBER_FASTSIM] = instance_parameter(i, ROLE_FASTSIM);
    number[NUMBER_AXLE_INERTIA] = law_value(i, ROLE_AXLE_INERTIA, k);
    if (profile->rows > 0) {
        number[NUMBER_FRICTION] = law_value(i, ROLE_FRICTION, k);
        return rolling_law(number, profile);
    }
    for (int role = ROLE_RADIUS; role <= ROLE_FLANGE_DEPTH; role++)
        number[role - ROLE_RADIUS] = law_value(i, (Role)role, k);
    number[NUMBER_HERTZ] = law_value(i, ROLE_HERTZ, k);
    number[NUMBER_TEXTBOOK] = instance_parameter(i, ROLE_TEXTBOOK);
    return rolling_law(number, NULL);
}

void instance_configure(Instance *i)
{
    const Model *m = &i->model;
    const size_t wheels = m->contact_sign != 0 ? m->sides * m->wheelsets : 0;
    ContactLaw *law = &i->motion.law;
    law->nonlinear = instance_parameter(i, ROLE_NONLINEAR) != 0;
    for (size_t k = 0; k < wheels; k++)
        if (m->rolls)
            law->rolling[k] = rolling_law_of(i, k);
        else
            law->number[k] = law_value(i, law->nonlinear ? ROLE_HERTZ : ROLE_STIFFNESS, k);
    i->motion.internal_step = instance_parameter(i, ROLE_INTERNAL_STEP);
}
