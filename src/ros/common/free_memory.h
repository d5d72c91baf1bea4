/// Gives memory that was freed back to the system.
///
/// Blocks of meshes are made on the threads of the map and freed by the output's; images and
/// messages come and go on others. The C library keeps what is freed in a pool for each thread,
/// between what lives on: in hours a process comes to hold three times what it uses.
#pragma once

#include "ros/common/schedule.h"

namespace dtsdf {

/// Takes milliseconds, more where much is free. Does nothing where the C library cannot do it.
void returnFreeMemory();

/// Does so again and again. One thread only.
class FreeMemory {
 public:
  explicit FreeMemory(SteadyClock clock);

  /// Call it often: it acts once in a while.
  void step();

 private:
  SteadyClock clock_;
  Pace pace_;
};

}  // namespace dtsdf
