/* $title: $unit of macromicro $version, exported.
   Made by a program: change the Python that it comes from. MIT licence. */
#include "$name.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

$helpers

$tables

$parameters

$functions

$begin
