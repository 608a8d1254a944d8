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

/* Solve delta + G force(delta) = gap by Newton's method from delta = gap; 0: it did not settle. */
int contact_solve(const ContactLaw *law, const double G[WHEELS * WHEELS],
                  const double gap[WHEELS], double delta[WHEELS]);
/* Solve A x = b in place (x in b) by elimination with pivoting; 0: singular or not finite. */
int solve_wheels(double A[WHEELS * WHEELS], double b[WHEELS]);

#endif
