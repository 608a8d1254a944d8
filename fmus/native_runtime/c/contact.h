/* Normal contact of wheel and rail, and its balance with what carries it. */
#ifndef RAILCOSIM_CONTACT_H
#define RAILCOSIM_CONTACT_H

#include "model.h"

/* F = C delta^1.5 with loss of contact, or F = k_H delta, which also pulls. */
typedef struct {
    int nonlinear;
    double *number; /* C or k_H of each contact */
} ContactLaw;

/* Of contact k. */
double contact_force(const ContactLaw *law, size_t k, double compression);
double contact_stiffness(const ContactLaw *law, size_t k, double compression);

/* Solve delta + G force(delta) = gap of n contacts by Newton's method from delta = gap; 0: it did
   not settle. `work` has room for CONTACT_WORK(n) numbers. */
#define CONTACT_WORK(n) ((n) * ((n) + 3))
int contact_solve(const ContactLaw *law, size_t n, const double *G, const double *gap,
                  double *delta, double *work);
/* Contact k over a step, from its compressions d at the beginning, on average and at the end: mean
   and slope of the line that is nearest to its force along the parabola through them, and their
   derivatives by d. */
void contact_over_step(const ContactLaw *law, size_t k, const double d[3], double force[2],
                       double tangent[2][3]);
/* Forces [means, slopes] of n contacts over a step, found from those that are there. `begin` are their compressions; on average and
   at the end these are `free`, [averages, ends], and what forces add: G has four parts, averages by
   means and by slopes, ends by means and by slopes. 0: they did not settle. `work` has room for
   BALANCE_WORK(n) numbers. */
#define BALANCE_WORK(n) (2 * (n) * (2 * (n) + 1))
int contact_balance(const ContactLaw *law, size_t n, const double *G, const double *begin,
                    const double *free, double *force, double *compression, double *work);
/* Derivative of the forces found, along changes of `begin` and `free`; 0: there is none. */
int contact_change(const ContactLaw *law, size_t n, const double *G, const double *begin,
                   const double *compression, const double *dbegin, const double *dfree,
                   double *dforce, double *work);
/* Solve A x = b of n unknowns in place (x in b) by elimination with pivoting; 0: singular or not
   finite. */
int solve_linear(size_t n, double *A, double *b);

#endif
