/// The options for a moving object that insert_object and evaluate_trail have in common.
#pragma once

#include "evaluation/moving_object.h"
#include "program/command_line.h"

namespace dtsdf {

/// --shape, --size, --from and --to, of which the last two are required.
void addObjectOptions(CommandLine& line, MovingObject& object);

}  // namespace dtsdf
