/// Loops over many indices on all cores, with progress.
#pragma once

#include <cstddef>
#include <functional>

namespace dtsdf {

/// Calls body(index) for the indices below `count`, from several threads, each of which takes some
/// at a time. `progress`, if given, is called by one thread at a time with the number of indices
/// done. The first exception of a body is thrown again here.
void forEachIndex(size_t count, const std::function<void(size_t)>& body,
                  const std::function<void(size_t)>& progress = {});

/// Calls body(index) for the images of a recording, from several threads, behind a progress bar.
void forEachImage(size_t count, const std::function<void(size_t)>& body);

}  // namespace dtsdf
