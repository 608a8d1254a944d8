#include "balance.h"

#include <math.h>
#include <string.h>

enum { MAX_ITERATIONS = 200 }; /* 3 or 4 are enough */
enum { APART = 10 };           /* iterations in which groups are solved for by themselves */
static const double RELATIVE_TOLERANCE = 1e-12; /* four digits above rounding */
static const double ROUNDING = 1e-14;           /* nothing is left of a change */
/* Of the last change (at first of the forces): where one is larger, derivatives are found anew. With
   old ones each is about a thousandth of the last, as is what groups do to each other. */
static const double FAST = 1e-2;
static const double SMALLEST_PART = 1e-3; /* of a change that is made where all of it leads away */

/* What is asked of a law at an instant: by q or by v. */
static void at_an_instant(const Question *question, size_t k, const double *q, const double *v,
                          int by_rates, double *force, double *tangent)
{
    const ContactLaw *law = question->law;
    Contact contact;
    contact_at(law, k, q, v, question->given + k * law->given, tangent != NULL, &contact);
    memcpy(force, contact.force + law->first, law->own * sizeof(double));
    for (size_t i = law->first; tangent != NULL && i < law->first + law->own; i++) {
        const double *by = (by_rates ? contact.by_v[i] : contact.by_q[i]) + law->first;
        memcpy(tangent, by, law->own * sizeof(double));
        tangent += law->own;
    }
}

void balance_at_rest(const Question *question, size_t k, const double *x, double *force,
                     double *tangent)
{
    static const double none[MOST_OWN] = {0};
    at_an_instant(question, k, x, none, 0, force, tangent);
}

void balance_at_once(const Question *question, size_t k, const double *x, double *force,
                     double *tangent)
{
    at_an_instant(question, k, question->known + k * question->law->own, x, 1, force, tangent);
}

void balance_over_step(const Question *question, size_t k, const double *x, double *force,
                       double *tangent)
{
    contact_over_step(question->law, k, question->way, x, force, tangent);
}

/* x = free + G force. */
static void move(const Question *question, const double *G, const double *free, const double *force,
                 double *x)
{
    const size_t n = question->n, parts = question->parts;
    memcpy(x, free, parts * n * sizeof(double));
    for (size_t part = 0; part < parts; part++)
        for (size_t by = 0; by < parts; by++)
            question->kernels->add_product(n, n, G + (part * parts + by) * n * n, force + by * n,
                                           x + part * n);
}

/* Forces that the law answers to x, and (NULL: not asked for) their derivatives, one contact after the
   other. */
static void ask_all(const Question *question, const double *x, double *found, double *tangents)
{
    const size_t own = question->law->own, n = question->n, parts = question->parts;
    double at[2 * MOST_OWN], force[2 * MOST_OWN];
    for (size_t port = 0; port < n; port += own) {
        const size_t first = question->port == NULL ? port : question->port[port];
        for (size_t part = 0; part < parts; part++)
            memcpy(at + part * own, x + part * n + port, own * sizeof(double));
        question->ask(question, first / own, at, force, tangents);
        for (size_t part = 0; part < parts; part++)
            memcpy(found + part * n + port, force + part * own, own * sizeof(double));
        if (tangents != NULL)
            tangents += parts * own * parts * own;
    }
}

/* Ports of the contacts that are solved for together with those of a group; returns how many. */
static size_t members(const Question *question, size_t together, size_t group, size_t *port)
{
    const size_t own = question->law->own;
    size_t m = 0;
    for (size_t k = 0; k < question->n; k += own) {
        const size_t first = question->port == NULL ? k : question->port[k];
        if (first / own % question->law->left / together == group)
            for (size_t j = 0; j < own; j++)
                port[m++] = k + j;
    }
    return m;
}

/* A = 1 - tangent G of the m ports of a group; `rows` has room for those of one contact. */
static void soften(const Question *question, const double *G, size_t m, const size_t *port,
                   const double *tangents, double *rows, double *A)
{
    const size_t own = question->law->own, n = question->n, parts = question->parts;
    const size_t wide = parts * own, all = parts * m;
    memset(A, 0, all * all * sizeof(double));
    for (size_t k = 0; k < m; k += own) {
        const double *tangent = tangents + port[k] / own * wide * wide;
        for (size_t row = 0; row < wide; row++) {
            const double *g = G + (row / own * parts * n + port[k] + row % own) * n;
            for (size_t by = 0; by < parts; by++)
                for (size_t j = 0; j < m; j++)
                    rows[row * all + by * m + j] = g[by * n * n + port[j]];
        }
        for (size_t part = 0; part < parts; part++)
            question->kernels->take_product(own, wide, all, tangent + part * own * wide, rows,
                                            A + (part * m + k) * all);
    }
    for (size_t i = 0; i < all; i++)
        A[i * all + i] += 1;
}

/* Factors of the matrices of groups of so many wheelsets, one behind the other. */
typedef struct {
    size_t together;
    size_t *row; /* by which elimination went, one number for each unknown */
    double *A, *scratch;
} Groups;

static size_t groups_of(const Question *question, size_t together)
{
    return (question->law->left + together - 1) / together;
}

static Groups groups_in(const Question *question, double *work)
{
    const size_t all = question->parts * question->n;
    const Groups groups = {0, (size_t *)work, work + (2 + question->parts * question->law->own) * all,
                           work + all};
    return groups;
}

static int factor_groups(const Question *question, size_t together, const double *G,
                         const double *tangents, Groups *groups)
{
    size_t port[MOST_PORTS_OF_ALL], *row = groups->row;
    double *A = groups->A;
    groups->together = together;
    for (size_t group = 0; group < groups_of(question, together); group++) {
        const size_t m = members(question, together, group, port), all = question->parts * m;
        soften(question, G, m, port, tangents, groups->scratch, A);
        if (!question->kernels->factor(all, A, row))
            return 0;
        A += all * all;
        row += all;
    }
    return 1;
}

/* Solve for changes, group by group: what groups do to each other is left to the next iteration. */
static void solve_groups(const Question *question, const Groups *groups, double *change)
{
    const size_t n = question->n, parts = question->parts;
    size_t port[MOST_PORTS_OF_ALL];
    const size_t *row = groups->row;
    const double *A = groups->A;
    double *own = groups->scratch;
    for (size_t group = 0; group < groups_of(question, groups->together); group++) {
        const size_t m = members(question, groups->together, group, port), all = parts * m;
        for (size_t part = 0; part < parts; part++)
            for (size_t k = 0; k < m; k++)
                own[part * m + k] = change[part * n + port[k]];
        question->kernels->substitute(all, A, row, own);
        for (size_t part = 0; part < parts; part++)
            for (size_t k = 0; k < m; k++)
                change[part * n + port[k]] = own[part * m + k];
        A += all * all;
        row += all;
    }
}

/* Root of the sum of squares of what forces lack. */
static double lacking(size_t n, const double *found, const double *force)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (found[k] - force[k]) * (found[k] - force[k]);
    return sqrt(sum);
}

/* Forces moved on by a part of a change; the largest of them, or no number. */
static double advance(size_t n, double part, const double *before, const double *change,
                      double *force)
{
    double largest = 0;
    for (size_t k = 0; k < n; k++) {
        force[k] = before[k] + part * change[k];
        if (!isfinite(force[k]))
            return NAN;
        largest = fmax(largest, fabs(force[k]));
    }
    return largest;
}

static double largest_of(size_t n, const double *x)
{
    double largest = 0;
    for (size_t k = 0; k < n; k++)
        largest = fmax(largest, fabs(x[k]));
    return largest;
}

int balance(const Question *question, const double *G, const double *free, double *force, double *x,
            double *work)
{
    const size_t n = question->n, all = question->parts * n;
    double *change = work, *before = change + all, *found = before + all, *tangents = found + all;
    Groups groups = groups_in(question, tangents + all * question->parts * question->law->own);
    double part = 1, wrong = INFINITY, last = 0;
    int anew = 1; /* whether derivatives are found */
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        move(question, G, free, force, x);
        ask_all(question, x, found, anew ? tangents : NULL);
        const double lacks = lacking(all, found, force);
        if (iteration == 0 && isnan(lacks))
            return 0;
        if (!(lacks <= wrong) && part >= SMALLEST_PART) { /* all of the change led away */
            part /= 2;
            anew = 1;
            advance(all, part, before, change, force);
            continue;
        }
        wrong = lacks;
        part = 1;
        memcpy(before, force, all * sizeof(double));
        for (size_t k = 0; k < all; k++)
            change[k] = found[k] - force[k];
        const size_t together = iteration < APART ? question->together : question->law->left;
        if (anew && !factor_groups(question, together, G, tangents, &groups))
            return 0;
        solve_groups(question, &groups, change);
        const double largest = advance(all, part, before, change, force);
        const double size = largest_of(all, change);
        /* The next change would be smaller again by as much at least as this one is than the last. */
        const double next = size < last ? size * (size / last) : size;
        anew = iteration + 1 >= APART || !(size <= FAST * (iteration > 0 ? last : largest));
        last = size;
        if (size <= RELATIVE_TOLERANCE * largest || next <= ROUNDING * largest) {
            move(question, G, free, force, x);
            return 1;
        }
        if (isnan(largest))
            return 0;
    }
    return 0;
}

int balance_change(const Question *question, const double *G, const double *x, double *dforce,
                   double *work)
{
    const size_t all = question->parts * question->n;
    double *found = work, *tangents = found + all;
    Groups groups = groups_in(question, tangents + all * question->parts * question->law->own);
    ask_all(question, x, found, tangents);
    if (!factor_groups(question, question->law->left, G, tangents, &groups))
        return 0;
    solve_groups(question, &groups, dforce);
    return 1;
}
