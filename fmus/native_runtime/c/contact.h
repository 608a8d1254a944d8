/* Normal contact of wheel and rail, and its balance with what carries it. */
#ifndef RAILCOSIM_CONTACT_H
#define RAILCOSIM_CONTACT_H

#include "model.h"

/* F = C delta^1.5 with loss of contact, or F = k_H delta, which also pulls. */
typedef struct {
    int nonlinear;
    double C, k_H;
} ContactLaw;

double contact_force(const ContactLaw *law, double compression);
double contact_stiffness(const ContactLaw *law, double compression);

/* Solve delta + G force(delta) = gap of n contacts by Newton's method from delta = gap; 0: it did
   not settle. `work` has room for CONTACT_WORK(n) numbers. */
#define CONTACT_WORK(n) ((n) * ((n) + 3))
int contact_solve(const ContactLaw *law, size_t n, const double *G, const double *gap,
                  double *delta, double *work);
/* Solve A x = b of n unknowns in place (x in b) by elimination with pivoting; 0: singular or not
   finite. */
int solve_linear(size_t n, double *A, double *b);

#endif
