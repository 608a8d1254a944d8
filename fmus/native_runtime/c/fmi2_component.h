/* What the files of the FMI 2.0 front share. */
#ifndef RAILCOSIM_FMI2_COMPONENT_H
#define RAILCOSIM_FMI2_COMPONENT_H

#include "fmi2Functions.h"
#include "instance.h"

#include <stddef.h>

typedef struct {
    Instance *instance;
    fmi2CallbackFunctions callbacks;
    char *name;
} Component;

static inline Instance *instance_of(fmi2Component c)
{
    return ((Component *)c)->instance;
}

/* Begin every function: an instance there must be, and the call must be allowed now. */
#define BEGIN(phases)                                                      \
    if (c == NULL || !instance_allows(instance_of(c), (phases), __func__)) \
        return fmi2Error;                                                  \
    Instance *i = instance_of(c)
#define DEMAND(condition, what) \
    if (!(condition))           \
    return (fmi2Status)instance_fail(i, "%s: %s", __func__, what)

#endif
