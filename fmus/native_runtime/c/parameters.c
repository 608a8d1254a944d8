/* What an instance's parameters make of its body. */
#include "instance.h"

#include <math.h>

double instance_parameter(const Instance *i, Role role)
{
    const uint32_t ref = i->model.of_role[role];
    return ref == UINT32_MAX ? 0 : i->value[ref];
}

/* A number of the law of contact k. */
static double law_value(const Instance *i, Role role, size_t k)
{
    const size_t n = i->model.wheelsets;
    return i->value[i->model.law[law_number(role) * n + k % n]];
}

static RollingLaw rolling_law(const Instance *i, size_t k)
{
    /* The creep coefficients are told at a normal force of so much. */
    const double root = cbrt(1 / ROLLING_REFERENCE);
    const RollingProfile *profile = &i->model.profile;
    if (profile->rows > 0) {
        const RollingLaw of_profile = {
            .profile = profile, .radius = profile->radius, .half_distance = profile->half_distance,
            .friction = law_value(i, ROLE_FRICTION, k),
            .axle_inertia = law_value(i, ROLE_AXLE_INERTIA, k),
            .speed = instance_parameter(i, ROLE_SPEED)};
        return of_profile;
    }
    const RollingLaw law = {
        NULL,
        law_value(i, ROLE_RADIUS, k),
        law_value(i, ROLE_HALF_DISTANCE, k),
        law_value(i, ROLE_CONICITY, k),
        law_value(i, ROLE_HEAD_RADIUS, k),
        instance_parameter(i, ROLE_TEXTBOOK) != 0,
        law_value(i, ROLE_HERTZ, k),
        {law_value(i, ROLE_CREEP_ALONG, k) * root * root,
         law_value(i, ROLE_CREEP_ACROSS, k) * root * root,
         law_value(i, ROLE_CREEP_SPIN, k) / ROLLING_REFERENCE,
         law_value(i, ROLE_CREEP_TURN, k) / ROLLING_REFERENCE * root},
        law_value(i, ROLE_FRICTION, k),
        law_value(i, ROLE_FLANGE_STIFFNESS, k),
        law_value(i, ROLE_FLANGE_CLEARANCE, k),
        law_value(i, ROLE_FLANGE_DEPTH, k),
        law_value(i, ROLE_AXLE_INERTIA, k),
        instance_parameter(i, ROLE_SPEED),
    };
    return law;
}

void instance_configure(Instance *i)
{
    const Model *m = &i->model;
    const size_t wheels = m->contact_sign != 0 ? m->sides * m->wheelsets : 0;
    ContactLaw *law = &i->motion.law;
    law->nonlinear = instance_parameter(i, ROLE_NONLINEAR) != 0;
    for (size_t k = 0; k < wheels; k++)
        if (m->rolls)
            law->rolling[k] = rolling_law(i, k);
        else
            law->number[k] = law_value(i, law->nonlinear ? ROLE_HERTZ : ROLE_STIFFNESS, k);
    i->motion.internal_step = instance_parameter(i, ROLE_INTERNAL_STEP);
}
