/* Forces of a body's own contacts at an instant, and their derivatives.

   A force that depends on rates jumps with them, and rates of a rail jump with the force: it is what
   agrees with the rates that it makes. */
#include "motion.h"

#include <string.h>

static size_t wheels_of(const Motion *motion)
{
    return motion->body.model->contacts / motion->law.own;
}

int motion_has_through(const Motion *motion, const Shapes *shapes)
{
    const Model *m = motion->body.model;
    int same = 1; /* to a vehicle's rates forces add nothing */
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        same &= motion->through_at[k] == shapes->place[k].position;
    return same;
}

void motion_take_through(Motion *motion, const Shapes *shapes)
{
    body_through_rest(&motion->body, shapes, motion->ones, motion->through);
    for (size_t k = 0; k < motion->body.model->wheelsets; k++)
        motion->through_at[k] = shapes->place[k].position;
}

static void find_through(Motion *motion, const Shapes *shapes)
{
    const Model *m = motion->body.model;
    if (motion_has_through(motion, shapes))
        return;
    body_no_compliance(&motion->body);
    for (size_t k = 0; k < m->chunks; k++)
        body_through_chunk(&motion->body, shapes, &m->chunk[k]);
    motion_take_through(motion, shapes);
}

/* Displacements and rates of the own ports without contact forces. */
static void look(Motion *motion, const Shapes *shapes, const double *x)
{
    Body *body = &motion->body;
    if (body->model->nodes > 0) {
        body_look(body, shapes, x, motion->none, 1, motion->no_g, motion->last.z,
                  motion->last.vz_free);
        return;
    }
    body_rate(body, x, NULL, motion->line[0]);
    body_observe(body, shapes, x, motion->last.z);
    body_observe(body, shapes, motion->line[0], motion->last.vz_free);
}

static Question at_once(const Motion *motion, const double *z, const double *given)
{
    const Model *m = motion->body.model;
    const Question question = {motion->body.kernels, &motion->law, m->contacts, NULL, 1,
                               m->wheelsets, balance_at_once, z, given, NULL};
    return question;
}

/* Forces that agree with the rates that they make, from those without any, and these rates. */
static int agree(Motion *motion, const double *given, double *force, double *v)
{
    const Model *m = motion->body.model;
    const ContactLaw *law = &motion->law;
    const double *z = motion->last.z, *free = motion->last.vz_free;
    if (m->nodes > 0) {
        const Question question = at_once(motion, z, given);
        memset(force, 0, m->contacts * sizeof(double));
        return balance(&question, motion->through, free, force, v, motion->solving);
    }
    memcpy(v, free, m->contacts * sizeof(double)); /* a vehicle's do not jump */
    for (size_t k = 0; k < wheels_of(motion); k++) {
        Contact contact;
        contact_at(law, k, z + k * law->own, v + k * law->own, given + k * law->given, 0, &contact);
        memcpy(force + k * law->own, contact.force + law->first, law->own * sizeof(double));
    }
    return motion->body.kernels->finite(m->contacts, force) == 0;
}

int motion_last_forces(Motion *motion, const Inputs *now, const double *x)
{
    const Model *m = motion->body.model;
    const size_t bytes = (inputs_size(m) - m->wheelsets) * sizeof(double);
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    Seen *last = &motion->last;
    if (motion_seen(motion) == NULL || !last->free) {
        look(motion, shapes, x);
        last->free = last->known = 1;
        last->rates = 0;
    } else if (last->rates && memcmp(last->given, now->load, bytes) == 0)
        return 1;
    find_through(motion, shapes);
    if (!agree(motion, now->load, last->under, last->vz))
        return 0;
    memcpy(last->given, now->load, bytes);
    motion_note_seen(motion, 1, last->under);
    return 1;
}

int motion_forces(Motion *motion, const Inputs *now, const double *x, double *force)
{
    const Model *m = motion->body.model;
    const size_t bytes = m->contacts * sizeof(double);
    const Seen *last = &motion->last;
    if (m->contact_sign == 0) {
        memcpy(force, now->load, bytes);
        return 1;
    }
    if (motion->law.of_rates) {
        motion_forget(motion); /* x may be any state */
        const int found = motion_last_forces(motion, now, x);
        memcpy(force, last->under, bytes);
        memcpy(motion->z, last->z, bytes);
        memcpy(motion->v, last->vz, bytes);
        motion_forget(motion);
        return found;
    }
    body_observe(&motion->body, body_shapes(&motion->body, now->position), x, motion->z);
    for (size_t k = 0; k < wheels_of(motion); k++)
        force[k] = motion_pressed(motion, k, motion->z, now->load);
    return 1;
}

double motion_pressed(const Motion *motion, size_t k, const double *z, const double *load)
{
    Contact contact;
    contact_at(&motion->law, k, z + k, NULL, load + k, 0, &contact);
    return contact.force[0];
}

void motion_on_other(const Motion *motion, const Inputs *now, const double *z, const double *vz,
                     double *force)
{
    const ContactLaw *law = &motion->law;
    const size_t wheels = motion->body.model->contact_sign != 0 ? wheels_of(motion) : 0;
    Contact contact;
    for (size_t k = 0; k < wheels; k++) {
        contact_at(law, k, z + k * law->own, vz + k * law->own, now->load + k * law->given,
                   0, &contact);
        memcpy(force + k * law->other, contact.force + law->beyond, law->other * sizeof(double));
    }
}

/* Change of `count` forces a contact, of all that there are from `first` on, along changes. */
static void change(const Motion *motion, size_t count, size_t first, const Inputs *now,
                   const double *z, const double *vz, const Inputs *along, const double *dz,
                   const double *dvz, double *dforce)
{
    const ContactLaw *law = &motion->law;
    double found[MOST_MOTIONS];
    Contact contact;
    for (size_t k = 0; k < wheels_of(motion); k++) {
        const size_t port = k * law->own, given = k * law->given;
        contact_at(law, k, z + port, vz + port, now->load + given, 1, &contact);
        contact_change(law, k, &contact, z + port, vz + port, now->load + given, dz + port,
                       dvz + port, along->load + given, found);
        memcpy(dforce + k * count, found + first, count * sizeof(double));
    }
}

void motion_on_other_change(const Motion *motion, const Inputs *now, const double *z,
                            const double *vz, const Inputs *along, const double *dz,
                            const double *dvz, double *dforce)
{
    change(motion, motion->law.other, motion->law.beyond, now, z, vz, along, dz, dvz, dforce);
}

/* Change of rates where the forces that are do not change: motion->dv. */
static void rates_change(Motion *motion, const Shapes *shapes, const Shapes *slope,
                         const double *x, const double *dx, const double *force)
{
    Body *body = &motion->body;
    double *rate = motion->line[0], *drate = motion->line[1];
    motion_drive(motion, shapes, force, motion->d0);
    body_rate(body, x, motion->d0, rate);
    motion_drive_change(motion, shapes, slope, force, motion->none, motion->d0);
    body_rate(body, dx, motion->d0, drate);
    motion_observe_change(motion, shapes, slope, rate, drate, motion->dv);
}

void motion_still_change(const Motion *motion, const Inputs *now, const double *z,
                         const Inputs *along, const double *dz, double *dforce)
{
    change(motion, motion->law.own, motion->law.first, now, z, motion->none, along, dz,
           motion->none, dforce);
}

void motion_known_forces_change(Motion *motion, const Shapes *shapes, const Shapes *slope,
                                const Inputs *now, const double *x, const double *force,
                                const double *z, const Inputs *along, const double *dx,
                                const double *dz, double *dforce)
{
    const ContactLaw *law = &motion->law;
    if (law->of_rates)
        rates_change(motion, shapes, slope, x, dx, force);
    change(motion, law->own, law->first, now, z, motion->v, along, dz, motion->dv, dforce);
    if (law->of_rates) {
        const Question question = at_once(motion, z, now->load);
        balance_change(&question, motion->through, motion->v, dforce, motion->solving);
    }
}

void motion_forces_change(Motion *motion, const Inputs *now, const double *x, const Inputs *along,
                          const double *dx, double *dforce)
{
    const Model *m = motion->body.model;
    double *force = motion->beyond[1];
    if (m->contact_sign == 0) {
        memcpy(dforce, along->load, m->contacts * sizeof(double));
        return;
    }
    motion_forces(motion, now, x, force);
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, shapes, along->position);
    motion_observe_change(motion, shapes, slope, x, dx, motion->dz);
    motion_known_forces_change(motion, shapes, slope, now, x, force, motion->z, along, dx,
                               motion->dz, dforce);
}
