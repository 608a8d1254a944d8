/* The law of contacts that a body owns, and the same over a step. */
#ifndef RAILCOSIM_CONTACT_H
#define RAILCOSIM_CONTACT_H

#include "model.h"
#include "rolling.h"

enum { MOST_MOTIONS = ROLLING_MOTIONS, MOST_OWN = ROLLING_WHEEL };

/* Contacts that are only pressed, F = C d^1.5 with loss of contact or F = k_H d, which also pulls; or
   wheels that roll. A contact has `motions`: those of the body's own ports, from `first` on, and of
   the other's, from `beyond` on; and as many forces. Beside what its own ports do, q and v, a law is
   `given` numbers a contact: what pressed contacts meet is so high; of rolling ones, what adds to
   their motions and to their rates, and the speed. */
typedef struct {
    size_t motions, given, own, first, other, beyond;
    int of_rates;
    int sign; /* of a compression by the body's motion */
    int nonlinear;
    double *number; /* C or k_H of each contact */
    RollingLaw *rolling; /* of each contact */
    size_t left; /* contacts, before those on the right */
} ContactLaw;

/* The law of a body, but for its numbers. */
ContactLaw contact_law(const Model *model);

/* A contact at an instant. */
typedef struct {
    double force[MOST_MOTIONS];
    double by_q[MOST_MOTIONS][MOST_MOTIONS], by_v[MOST_MOTIONS][MOST_MOTIONS];
} Contact;

/* Contact k, where its body's ports move by q, at rates v; and, if `changes` are asked for, how its
   forces change there. */
void contact_at(const ContactLaw *law, size_t k, const double *q, const double *v,
                const double *given, int changes, Contact *contact);
void contact_change(const ContactLaw *law, size_t k, const Contact *contact, const double *q,
                    const double *v, const double *given, const double *dq, const double *dv,
                    const double *dgiven, double dforce[MOST_MOTIONS]);

/* What contacts do over a step of length h: motions of all own ports at the beginning; at the
   beginning, on average and at the end, by how much motions where the wheels are differ from those of
   the material in the middle of their way, and what the law is given. */
typedef struct {
    double h;
    const double *begin, *rolled[3], *given[3];
} Way;

/* Means and slopes [mean, slope][own] of the lines that are nearest to the forces of contact k along
   the parabola of its motions, by these on average and at the end [average, end][own]; and (NULL: not
   asked for) their derivatives, (2 own, 2 own). Rates are the parabola's own. */
void contact_over_step(const ContactLaw *law, size_t k, const Way *way, const double *x,
                       double *force, double *tangent);
/* Their changes along one of the way and dx. */
void contact_over_step_change(const ContactLaw *law, size_t k, const Way *way, const double *x,
                              const Way *change, const double *dx, double *dforce);

#endif
