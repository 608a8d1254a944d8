#include "contact.h"

#include <math.h>
#include <string.h>

ContactLaw contact_law(const Model *m)
{
    ContactLaw law = {1, m->given, 1, 0, 1, 0, 0, m->contact_sign, 0, NULL, NULL,
                      m->wheelsets};
    if (m->rolls) {
        const int wheel = m->contact_sign > 0;
        law.motions = ROLLING_MOTIONS;
        law.own = wheel ? WHEEL_DIRECTIONS : RAIL_DIRECTIONS;
        law.other = wheel ? RAIL_DIRECTIONS : WHEEL_DIRECTIONS;
        law.first = wheel ? 0 : WHEEL_DIRECTIONS;
        law.beyond = wheel ? WHEEL_DIRECTIONS : 0;
        law.of_rates = 1;
    }
    return law;
}

/* All motions and rates of a contact, or changes of them. */
static void meet(const ContactLaw *law, const double *q, const double *v, const double *given,
                 double *motion, double *rate)
{
    if (!law->of_rates) {
        motion[0] = law->sign * (q[0] - given[0]);
        return;
    }
    memcpy(motion, given, law->motions * sizeof(double));
    memcpy(rate, given + law->motions, law->motions * sizeof(double));
    for (size_t i = 0; i < law->own; i++) {
        motion[law->first + i] += q[i];
        rate[law->first + i] += v[i];
    }
}

void contact_at(const ContactLaw *law, size_t k, const double *q, const double *v,
                const double *given, int changes, Contact *contact)
{
    double motion[MOST_MOTIONS], rate[MOST_MOTIONS];
    meet(law, q, v, given, motion, rate);
    if (law->of_rates) {
        rolling_force(&law->rolling[k], given[ROLLING_SPEED], k < law->left ? -1 : 1, motion, rate,
                      contact->force, changes ? contact->by_q : NULL,
                      changes ? contact->by_v : NULL);
        return;
    }
    const double d = motion[0], number = law->number[k], root = d > 0 ? sqrt(d) : 0;
    contact->force[0] = law->nonlinear ? (d > 0 ? number * d * root : 0.0) : number * d;
    contact->by_q[0][0] = law->sign * (law->nonlinear ? 1.5 * number * root : number);
    contact->by_v[0][0] = 0;
}

/* What a change of the speed adds. */
static void add_faster(const ContactLaw *law, size_t k, const Contact *contact, const double *q,
                       const double *v, const double *given, double change,
                       double dforce[MOST_MOTIONS])
{
    double motion[MOST_MOTIONS], rate[MOST_MOTIONS], by_speed[MOST_MOTIONS];
    meet(law, q, v, given, motion, rate);
    rolling_by_speed(&law->rolling[k], given[ROLLING_SPEED], rate, contact->by_v[0], by_speed);
    for (size_t i = 0; i < law->motions; i++)
        dforce[i] += by_speed[i] * change;
}

void contact_change(const ContactLaw *law, size_t k, const Contact *contact, const double *q,
                    const double *v, const double *given, const double *dq, const double *dv,
                    const double *dgiven, double dforce[MOST_MOTIONS])
{
    double motion[MOST_MOTIONS], rate[MOST_MOTIONS];
    meet(law, dq, dv, dgiven, motion, rate);
    if (!law->of_rates) {
        dforce[0] = contact->by_q[0][0] * law->sign * motion[0];
        return;
    }
    for (size_t i = 0; i < law->motions; i++) {
        dforce[i] = 0;
        for (size_t j = 0; j < law->motions; j++)
            dforce[i] += contact->by_q[i][j] * motion[j] + contact->by_v[i][j] * rate[j];
    }
    if (dgiven[ROLLING_SPEED] != 0)
        add_faster(law, k, contact, q, v, given, dgiven[ROLLING_SPEED], dforce);
}

/* A node of Gauss's rule, which is exact for a line times a parabola: its place from the middle of
   the step (-1..1), its weight, and what a parabola is there, and its rate over a step of length 1, by
   its value at the beginning, its mean, and its value at the end. */
typedef struct {
    double odd, weight, value[3], rate[3];
} Node;

#define BOW(x) (1.5 * (x) * (x) - 0.5)
#define NODE_AT(x, weight)                                                                     \
    {x, weight, {0.5 * BOW(x) - 0.5 * (x), 1 - BOW(x), 0.5 * BOW(x) + 0.5 * (x)},              \
     {3 * (x) - 1, -6 * (x), 3 * (x) + 1}}
#define OUTER 0.77459666924148338 /* the root of 3/5 */
static const Node NODE[3] = {NODE_AT(-OUTER, 5.0 / 18), NODE_AT(0.0, 8.0 / 18),
                             NODE_AT(OUTER, 5.0 / 18)};

/* Motions and rates of the own ports of contact k at a node, and what is given there. */
static void pass(const ContactLaw *law, size_t k, const Way *way, const Node *node,
                 const double *x, double *q, double *v, double *given)
{
    const size_t own = law->own, g = law->given;
    const double *z[3] = {way->begin + k * own, x, x + own};
    for (size_t i = 0; i < own; i++)
        q[i] = node->value[0] * z[0][i] + node->value[1] * z[1][i] + node->value[2] * z[2][i];
    for (size_t i = 0; law->of_rates && i < own; i++) {
        v[i] = 0;
        for (int at = 0; at < 3; at++)
            v[i] += node->rate[at] * (z[at][i] - way->rolled[at][k * own + i]);
        v[i] /= way->h;
    }
    for (size_t i = 0; i < g; i++)
        given[i] = node->value[0] * way->given[0][k * g + i] +
                   node->value[1] * way->given[1][k * g + i] +
                   node->value[2] * way->given[2][k * g + i];
}

/* Add part of what a contact's forces change by at a node to the derivatives by motions on average and
   at the end, (own, 2 own). */
static void add_changes(const ContactLaw *law, const Way *way, const Node *node, double part,
                        const Contact *contact, double *tangent)
{
    const size_t own = law->own;
    for (size_t at = 0; at < 2; at++) {
        const double value = part * node->value[1 + at], rate = part * node->rate[1 + at] / way->h;
        for (size_t i = 0; i < own; i++) {
            const double *by_q = contact->by_q[law->first + i] + law->first;
            const double *by_v = contact->by_v[law->first + i] + law->first;
            double *row = tangent + (2 * i + at) * own;
            for (size_t l = 0; l < own; l++)
                row[l] += value * by_q[l] + rate * by_v[l];
        }
    }
}

void contact_over_step(const ContactLaw *law, size_t k, const Way *way, const double *x,
                       double *force, double *tangent)
{
    const size_t own = law->own, wide = 2 * own;
    double q[MOST_OWN], v[MOST_OWN], given[ROLLING_GIVEN];
    Contact contact;
    memset(force, 0, wide * sizeof(double));
    if (tangent != NULL)
        memset(tangent, 0, wide * wide * sizeof(double));
    for (int j = 0; j < 3; j++) {
        const Node *node = &NODE[j];
        const double part[2] = {node->weight, 3 * node->odd * node->weight};
        pass(law, k, way, node, x, q, v, given);
        contact_at(law, k, q, v, given, tangent != NULL, &contact);
        for (size_t p = 0; p < 2; p++) {
            for (size_t i = 0; i < own; i++)
                force[p * own + i] += part[p] * contact.force[law->first + i];
            if (tangent != NULL)
                add_changes(law, way, node, part[p], &contact, tangent + p * own * wide);
        }
    }
}

void contact_over_step_change(const ContactLaw *law, size_t k, const Way *way, const double *x,
                              const Way *change, const double *dx, double *dforce)
{
    double q[MOST_OWN], v[MOST_OWN], given[ROLLING_GIVEN], found[MOST_MOTIONS];
    double dq[MOST_OWN], dv[MOST_OWN], dgiven[ROLLING_GIVEN];
    Contact contact;
    memset(dforce, 0, 2 * law->own * sizeof(double));
    for (int j = 0; j < 3; j++) {
        const Node *node = &NODE[j];
        pass(law, k, way, node, x, q, v, given);
        pass(law, k, change, node, dx, dq, dv, dgiven);
        contact_at(law, k, q, v, given, 1, &contact);
        contact_change(law, k, &contact, q, v, given, dq, dv, dgiven, found);
        for (size_t i = 0; i < law->own; i++) {
            dforce[i] += node->weight * found[law->first + i];
            dforce[law->own + i] += 3 * node->odd * node->weight * found[law->first + i];
        }
    }
}
