/* An FMU that costs next to nothing: y[i] = u[(i + 1) mod inputs] / 2 + i + (steps mod 8).
 *
 * Every output changes in every step, so no importer can save a call. At its end it tells the file
 * $MIXER_COUNTS what was asked of it: steps, values set, values got, and the last outputs.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    char name[64];
    long steps, set, got;
    double u[INPUTS], y[OUTPUTS];
} Mixer;

static void mix(Mixer *m)
{
    for (int i = 0; i < OUTPUTS; i++)
        m->y[i] = 0.5 * m->u[(i + 1) % INPUTS] + i + (double)(m->steps % 8);
}

static void tell(const Mixer *m)
{
    const char *path = getenv("MIXER_COUNTS");
    FILE *file = path ? fopen(path, "a") : NULL;
    if (!file) return;
    fprintf(file, "%s %ld %ld %ld", m->name, m->steps, m->set, m->got);
    for (int i = 0; i < OUTPUTS; i++) fprintf(file, " %.17g", m->y[i]);
    fprintf(file, "\n");
    fclose(file);
}
