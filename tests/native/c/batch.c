/* The list of calls of master/batch, on functions as FMI declares them. */
#include <assert.h>
#include <math.h>
#include <stdio.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"

#include BATCH

static double held[2], times[2];
static int stops;

static fmi2Status fmi2_sets(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real v[])
{
    assert(c == held && n == 2 && vr[0] == 7 && vr[1] == 8);
    held[0] = v[0], held[1] = v[1];
    return fmi2OK;
}

static fmi2Status fmi2_steps(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean is_final)
{
    assert(c == held && is_final);
    times[0] = t, times[1] = h;
    return stops ? fmi2Discard : fmi2OK;
}

static fmi3Status fmi3_gets(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[], size_t n_v)
{
    assert(c == held && n == 1 && vr[0] == 9 && n_v == 2);
    v[0] = -held[0], v[1] = -held[1];
    return fmi3OK;
}

static fmi3Status fmi3_steps(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean is_final,
                        fmi3Boolean *event, fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *last)
{
    assert(c == held && !is_final);
    *event = *end = false;
    *early = t > 1.0;
    *last = t + (*early ? h / 2 : h);
    return fmi3OK;
}

int main(void)
{
    const double from[] = {1.5, 2.5, 3.5};
    const int64_t places[] = {2, 0};
    const unsigned vr[] = {7, 8}, one[] = {9};
    double u[2] = {0}, y[2] = {0}, span[] = {1.0, 0.25}, last = 0;
    uint8_t flags[4] = {0};
    Row gathers = {.kind = GATHER, .places = places, .count = 2, .values = u, .from = from};
    Row sets = {.kind = PASS2, .function = (void (*)(void))fmi2_sets, .instance = held, .places = vr,
                .count = 2, .values = u};
    Row steps2 = {.kind = STEP2, .function = (void (*)(void))fmi2_steps, .instance = held, .is_final = 1,
                  .span = span};
    Row steps3 = {.kind = STEP3, .function = (void (*)(void))fmi3_steps, .instance = held, .span = span,
                  .flags = flags, .last = &last};
    Row gets = {.kind = PASS3, .function = (void (*)(void))fmi3_gets, .instance = held, .places = one,
                .count = 1, .values = y, .size = 2};
    Row pythons = {.kind = BY_PYTHON};
    Row *all[] = {&gathers, &sets, &steps2, &pythons, &steps3, &gets};
    int32_t status;

    assert(railcosim_make(all, 0, 0, &status) == 0);
    /* What Python has to make stops it; from behind that it goes on. */
    assert(railcosim_make(all, 6, 0, &status) == 3 && status == NOT_MADE);
    assert(held[0] == 3.5 && held[1] == 1.5 && times[0] == 1.0 && times[1] == 0.25);
    assert(steps2.time == 1.25 && steps3.time == 0.0 && y[0] == 0.0);
    assert(railcosim_make(all, 6, 4, &status) == 6);
    assert(steps3.time == 1.25 && last == 1.25 && y[0] == -3.5 && y[1] == -1.5);
    /* A status, and what FMI 3 has to say without one: nothing behind it is made. */
    stops = 1, span[0] = 1.25;
    assert(railcosim_make(all, 6, 0, &status) == 2 && status == fmi2Discard && steps2.time == 1.25);
    y[0] = 0.0;
    assert(railcosim_make(all, 6, 4, &status) == 4 && status == fmi3OK);
    assert(flags[2] && last == 1.375 && steps3.time == 1.25 && y[0] == 0.0);
    /* So does what the master itself asks for. */
    span[0] = 0.0, flags[3] = 1;
    assert(railcosim_make(all, 6, 4, &status) == 4);
    flags[3] = 0;
    assert(railcosim_make(all, 6, 4, &status) == 6 && y[0] == -3.5);
    puts("all well");
    return 0;
}
