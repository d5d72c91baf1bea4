/// The rules of glTF 2.0 that its validator by the Khronos Group checks, for files of one mesh, and
/// what viewers need beside them. Written by the specification, with nothing of the writer.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

/// What is wrong with a .glb, one line each; empty: nothing.
std::vector<std::string> glbProblems(const std::string& bytes);

}  // namespace dtsdf
