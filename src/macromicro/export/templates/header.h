/* $title: $unit of macromicro $version, exported.
   Made by a program: change the Python that it comes from. MIT licence. */
#ifndef ${guard}_H
#define ${guard}_H

#include <stdbool.h>
#include <stdint.h>

$constants

$structs

$parameters

$begin

$functions

#endif
