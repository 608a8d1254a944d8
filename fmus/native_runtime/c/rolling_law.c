#include "rolling_law.h"

#include <math.h>
#include <string.h>

/* Friction of 0 bounds nothing. */
static Creep *creep_law(const double number[ROLLING_NUMBERS])
{
    if (!(number[NUMBER_FRICTION] > 0))
        return creep_linear;
    return number[NUMBER_FASTSIM] != 0 ? creep_fastsim : creep_saturated;
}

RollingLaw rolling_law(const double number[ROLLING_NUMBERS], const RollingProfile *profile)
{
    /* The creep coefficients are told at a normal force of so much. */
    const double root = cbrt(1 / ROLLING_REFERENCE), *creep = number + NUMBER_CREEP;
    const double *axis = number + NUMBER_ELLIPSE;
    if (profile != NULL) {
        const RollingLaw of_profile = {
            .profile = profile, .radius = profile->radius, .half_distance = profile->half_distance,
            .friction = number[NUMBER_FRICTION], .creep = creep_law(number),
            .axle_inertia = number[NUMBER_AXLE_INERTIA]};
        return of_profile;
    }
    const RollingLaw law = {
        NULL,
        number[NUMBER_RADIUS],
        number[NUMBER_HALF_DISTANCE],
        number[NUMBER_CONICITY],
        number[NUMBER_HEAD_RADIUS],
        number[NUMBER_TEXTBOOK] != 0,
        number[NUMBER_HERTZ],
        {creep[0] * root * root, creep[1] * root * root, creep[2] / ROLLING_REFERENCE,
         creep[3] / ROLLING_REFERENCE * root, axis[0] * root, axis[1] * root},
        number[NUMBER_FRICTION],
        creep_law(number),
        number[NUMBER_FLANGE_STIFFNESS],
        number[NUMBER_FLANGE_CLEARANCE],
        number[NUMBER_FLANGE_DEPTH],
        number[NUMBER_AXLE_INERTIA],
    };
    return law;
}

/* --- for masters ------------------------------------------------------------------------------- */

typedef struct {
    RollingLaw law;
    double side;
} Wheel;

typedef struct {
    size_t contacts;
    RollingProfile profile;
    Wheel wheel[];
} Laws;

size_t railcosim_rolling_size(size_t contacts)
{
    return sizeof(Laws) + contacts * sizeof(Wheel);
}

int railcosim_rolling_make(void *laws, size_t contacts, const double *side, const double *numbers,
                           size_t rows, const double *table, const double *about)
{
    Laws *all = laws;
    memset(all, 0, sizeof *all);
    all->contacts = contacts;
    if (rows > 0) {
        const RollingProfile profile = {
            .rows = rows, .table = table, .reference = about[0], .half_distance = about[1],
            .first = about[2], .step = about[3], .shear_modulus = about[4]};
        all->profile = profile;
        if (!rolling_profile_ready(&all->profile))
            return 0;
    }
    for (size_t k = 0; k < contacts; k++) {
        all->wheel[k].law = rolling_law(numbers + k * ROLLING_NUMBERS,
                                        rows > 0 ? &all->profile : NULL);
        all->wheel[k].side = side[k];
    }
    return 1;
}

void railcosim_rolling_ask(const void *laws, size_t times, const double *motions, double *forces,
                           double *tangents)
{
    const Laws *all = laws;
    const size_t n = ROLLING_MOTIONS;
    double by_q[ROLLING_MOTIONS][ROLLING_MOTIONS], by_v[ROLLING_MOTIONS][ROLLING_MOTIONS];
    double by_speed[ROLLING_MOTIONS];
    const int asked = tangents != NULL;
    for (size_t at = 0; at < times * all->contacts; at++, motions += ROLLING_GIVEN, forces += n) {
        const Wheel *wheel = &all->wheel[at % all->contacts];
        const double speed = motions[ROLLING_SPEED];
        rolling_force(&wheel->law, speed, wheel->side, motions, motions + n, forces,
                      asked ? by_q : NULL, asked ? by_v : NULL);
        if (asked)
            rolling_by_speed(&wheel->law, speed, motions + n, by_v[0], by_speed);
        for (size_t i = 0; asked && i < n; i++, tangents += ROLLING_GIVEN) {
            memcpy(tangents, by_q[i], sizeof by_q[i]);
            memcpy(tangents + n, by_v[i], sizeof by_v[i]);
            tangents[ROLLING_SPEED] = by_speed[i];
        }
    }
}
