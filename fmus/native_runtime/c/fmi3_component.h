/* What the files of the FMI 3.0 front share. */
#ifndef RAILCOSIM_FMI3_COMPONENT_H
#define RAILCOSIM_FMI3_COMPONENT_H

#include "fmi3Functions.h"
#include "instance.h"

#include <stddef.h>

typedef struct {
    Instance *instance;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Component;

static inline Instance *instance_of(fmi3Instance c)
{
    return ((Component *)c)->instance;
}

/* Begin every function: an instance there must be, and the call must be allowed now. */
#define BEGIN(phases)                                                      \
    if (c == NULL || !instance_allows(instance_of(c), (phases), __func__)) \
        return fmi3Error;                                                  \
    Instance *i = instance_of(c)
#define DEMAND(condition, what) \
    if (!(condition))           \
    return (fmi3Status)instance_fail(i, "%s: %s", __func__, what)

#endif
