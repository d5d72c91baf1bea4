/// Which topics there are that depth may come from, for those who wait for another one.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

/// Published topics of images with "depth" in their name, sorted; compressed ones by the name of
/// their image. Asks the master, and waits for it no longer than for its answer; empty without one.
std::vector<std::string> findDepthTopics();

}  // namespace dtsdf
