#include "backend/profile.h"

namespace dtsdf {

const char* toString(Stage stage) {
  switch (stage) {
    case Stage::kAlign: return "align";
    case Stage::kSense: return "sense";
    case Stage::kMakeSurfels: return "make_surfels";
    case Stage::kFindBlocks: return "find_blocks";
    case Stage::kSeeFree: return "see_free";
    case Stage::kAdmit: return "admit";
    case Stage::kCast: return "cast";
    case Stage::kClear: return "clear";
    case Stage::kPaint: return "paint";
    case Stage::kRender: return "render";
    case Stage::kIndex: return "index";
    case Stage::kMake: return "make";
    case Stage::kReturn: return "return";
    case Stage::kFindCells: return "find_cells";
  }
  return "unknown";
}

}  // namespace dtsdf
