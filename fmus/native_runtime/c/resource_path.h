/* Where an FMU's resources are. */
#ifndef RAILCOSIM_RESOURCE_PATH_H
#define RAILCOSIM_RESOURCE_PATH_H

/* Path of the model file in the folder a file: URI (FMI 2) or a path (FMI 3) names; to be freed.
   NULL: no such URI, or no memory. */
char *resource_path_from_uri(const char *uri);
char *resource_path(const char *folder);

#endif
