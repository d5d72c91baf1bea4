/// A loop over the images of a recording on all cores.
#pragma once

#include <cstddef>
#include <functional>

namespace dtsdf {

/// Calls body(index) for each image, from several threads, behind a progress bar. The first
/// exception of a body is thrown again here.
void forEachImage(size_t count, const std::function<void(size_t)>& body);

}  // namespace dtsdf
