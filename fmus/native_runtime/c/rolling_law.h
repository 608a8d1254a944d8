/* The law of wheels that roll, from the numbers that are told of it. */
#ifndef RAILCOSIM_ROLLING_LAW_H
#define RAILCOSIM_ROLLING_LAW_H

#include "rolling.h"

/* The numbers of a contact, in the order of their roles in model.h, and what is told of all; creep
   coefficients and semi-axes at ROLLING_REFERENCE. */
enum {
    NUMBER_RADIUS, NUMBER_HALF_DISTANCE, NUMBER_CONICITY, NUMBER_HEAD_RADIUS, NUMBER_CREEP,
    NUMBER_ELLIPSE = NUMBER_CREEP + 4, NUMBER_FRICTION = NUMBER_ELLIPSE + 2,
    NUMBER_FLANGE_STIFFNESS, NUMBER_FLANGE_CLEARANCE, NUMBER_FLANGE_DEPTH, NUMBER_HERTZ,
    NUMBER_TEXTBOOK, NUMBER_FASTSIM, NUMBER_AXLE_INERTIA, ROLLING_NUMBERS
};

/* With a table of profiles (NULL: cones) only friction, how it bounds, and the axle's inertia
   count. */
RollingLaw rolling_law(const double number[ROLLING_NUMBERS], const RollingProfile *profile);

/* --- for who has no FMU: a master that owns the contact ---------------------------------------- */

#ifdef _WIN32
#define FOR_MASTERS __declspec(dllexport)
#elif defined(__GNUC__)
#define FOR_MASTERS __attribute__((visibility("default")))
#else
#define FOR_MASTERS
#endif

/* Bytes that the laws of some contacts take. */
FOR_MASTERS size_t railcosim_rolling_size(size_t contacts);
/* Make them, those on the left first: numbers are (contacts, ROLLING_NUMBERS). `table` (rows,
   PROFILE_COLUMNS) of profiles, if there are rows, stays where it is; `about` is reference, half
   distance, first, step and shear modulus. 0: the table makes no sense. */
FOR_MASTERS int railcosim_rolling_make(void *laws, size_t contacts, const double *side,
                                       const double *numbers, size_t rows, const double *table,
                                       const double *about);
/* Forces, (times, contacts, ROLLING_MOTIONS), of motions, rates and speed of each; and their
   derivatives, (times, contacts, ROLLING_MOTIONS, ROLLING_GIVEN), if they are asked for. */
FOR_MASTERS void railcosim_rolling_ask(const void *laws, size_t times, const double *motions,
                                       double *forces, double *tangents);

#endif
