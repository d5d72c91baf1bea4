#include "backend/profile.h"

namespace dtsdf {

const char* toString(Stage stage) {
  switch (stage) {
    case Stage::kCopy: return "copy";
    case Stage::kUpload: return "upload";
    case Stage::kAlign: return "align";
    case Stage::kSense: return "sense";
    case Stage::kMakeSurfels: return "make_surfels";
    case Stage::kFindBlocks: return "find_blocks";
    case Stage::kSeeFree: return "see_free";
    case Stage::kAdmit: return "admit";
    case Stage::kCast: return "cast";
    case Stage::kFold: return "fold";
    case Stage::kClear: return "clear";
    case Stage::kPaint: return "paint";
    case Stage::kRender: return "render";
    case Stage::kIndex: return "index";
    case Stage::kMake: return "make";
    case Stage::kFetch: return "fetch";
    case Stage::kHandOut: return "hand_out";
    case Stage::kFindCells: return "find_cells";
  }
  return "unknown";
}

const char* toString(MemoryKind kind) {
  switch (kind) {
    case MemoryKind::kMap: return "map";
    case MemoryKind::kIndices: return "indices";
    case MemoryKind::kMesh: return "mesh";
    case MemoryKind::kScratch: return "scratch";
    case MemoryKind::kSpace: return "space";
    case MemoryKind::kStaging: return "staging";
  }
  return "unknown";
}

}  // namespace dtsdf
