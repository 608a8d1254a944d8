/* Springs with a gap that closes, at fixed places of a track: they press where closed, and never
   pull. */
#ifndef RAILCOSIM_GAPS_H
#define RAILCOSIM_GAPS_H

#include "exponential.h"

/* Where each stands, and scratch: one number a gap, or their square. */
typedef struct {
    double *begin, *end, *force, *slope, *off, *step, *free, *dbegin, *dforce;
    double *G, *S, *A;  /* stretches by forces over a step, at rest; what is solved */
    size_t *row;        /* by which elimination went */
    double *weight;     /* of modes, over a step: 2 * modes */
    double *R, *part;   /* motions of contacts by forces at rest, (gaps, contacts); and parts of it */
    double *closed;     /* at rest: 1 or 0 */
    double h;           /* step that G and weight are of */
    int known;          /* whether S is */
} GapWork;

void gaps_lay_out(GapWork *work, const Model *model, Arrays *arrays);
/* What springs do in a step, added to its end `next`; x is its beginning. 0: they did not settle. */
int gaps_step(const Body *body, GapWork *work, const Coefficients *c, const double *x,
              double *next);
/* The same where the change of the end is dnext, and that of the beginning dx; both ends move on. */
int gaps_step_change(const Body *body, GapWork *work, const Coefficients *c, const double *begin,
                     const double *dbegin, double *next, double *dnext);
/* Stretches of a state. */
void gaps_stretch(const Model *model, const double *x, double *stretch);
/* The same at rest, from x without the springs. */
int gaps_rest(const Body *body, GapWork *work, double *x);
/* Contacts on a track at rest of which some gaps are closed: their compliance G less what these take,
   and by how much they lift the contacts. */
void gaps_soften(const Body *body, const Shapes *shapes, GapWork *work, double *G, double *lifted);
/* Which gaps are closed at rest under forces at the contacts if those were. 0: others than before. */
int gaps_stay(const Body *body, GapWork *work, const double *force);
/* Change at rest, from dx without the springs; those that are closed stay so. */
int gaps_rest_change(const Body *body, GapWork *work, double *dx);

#endif
