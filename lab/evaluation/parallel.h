/// Loops over many indices on all cores, with progress.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

#include "threads/parallel.h"

namespace dtsdf {

/// Calls body(index) for the indices below `count`, from several threads, each of which takes some
/// at a time. `progress`, if given, is called by one thread at a time with the number of indices
/// done. The first exception of a body is thrown again here.
void forEachIndex(size_t count, const std::function<void(size_t)>& body,
                  const std::function<void(size_t)>& progress = {});

/// `sum` with what body(begin, end, part) adds to a copy of it for each chunk, by part.merge(), in
/// the order of the chunks: the same to the last bit on any number of threads. `sum` has to be
/// empty.
template <class Sum, class Body>
Sum sumOverChunks(size_t count, size_t chunk, Sum sum, const Body& body) {
  const Sum none = sum;
  const auto make = [&](size_t i) {
    Sum part = none;
    body(i * chunk, std::min((i + 1) * chunk, count), part);
    return part;
  };
  makeInOrder((count + chunk - 1) / chunk, 0, make,
              [&](size_t, const Sum& part) { sum.merge(part); });
  return sum;
}

/// Calls body(index) for the images of a recording, from several threads, behind a progress bar.
void forEachImage(size_t count, const std::function<void(size_t)>& body);

}  // namespace dtsdf
