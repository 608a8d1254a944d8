/* The balance of contact forces with what they move. */
#ifndef RAILCOSIM_BALANCE_H
#define RAILCOSIM_BALANCE_H

#include "contact.h"
#include "kernels.h"

/* What contacts answer to motions x of their own ports: `parts` numbers a port, and as many forces. */
typedef struct Question Question;
struct Question {
    const Kernels *kernels;
    const ContactLaw *law;
    size_t n;           /* ports, those of a contact together */
    const size_t *port; /* which of all they are; NULL: all in their order */
    size_t parts;
    size_t together;    /* wheelsets whose contacts are solved for at once; others hardly answer */
    /* Forces of contact k by x, each (parts, own), and (NULL: not asked for) their derivatives. */
    void (*ask)(const Question *question, size_t k, const double *x, double *force,
                double *tangent);
    const double *known, *given; /* of all contacts: motions of own ports where x are rates */
    const Way *way;
};

/* At rest, x are motions; at once, rates; over a step, motions on average and at its end, by means
   and slopes of forces. */
void balance_at_rest(const Question *question, size_t k, const double *x, double *force,
                     double *tangent);
void balance_at_once(const Question *question, size_t k, const double *x, double *force,
                     double *tangent);
void balance_over_step(const Question *question, size_t k, const double *x, double *force,
                       double *tangent);

/* Forces by Newton's method from those that are there, with derivatives that are kept as long as they
   lead there fast, and x = free + G force: G is (parts of x, parts
   of forces) matrices of (n, n), x and forces are (parts, n). 0: they did not settle. `work` has room
   for BALANCE_WORK(parts * n) numbers. */
#define BALANCE_WORK(n) ((n) * ((n) + 5 + 4 * MOST_OWN))
enum { MOST_PORTS_OF_ALL = 2 * MOST_WHEELSETS * MOST_OWN };
int balance(const Question *question, const double *G, const double *free, double *force, double *x,
            double *work);
/* dforce from what it is where motions that forces do not make change alone, to what it is; 0: there
   is none. */
int balance_change(const Question *question, const double *G, const double *x, double *dforce,
                   double *work);

#endif
