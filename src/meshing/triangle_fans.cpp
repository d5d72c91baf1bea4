#include "meshing/triangle_fans.h"

#include <algorithm>

namespace dtsdf {

TriangleFans::TriangleFans(const Mesh& mesh)
    : ends_(mesh.vertices_m.size()), mark_(mesh.vertices_m.size(), 0) {
  const Triangle none{kNone, kNone, kNone};
  faces_.reserve(mesh.triangles.size());
  for (const Triangle& corners : mesh.triangles) {
    const auto first = static_cast<uint32_t>(4 * faces_.size());
    faces_.push_back({corners, none, kNone});
    for (uint32_t at = 0; at < 3; ++at) {
      Ends& ends = ends_[corners[at]];
      (ends.head == kNone ? ends.head : next(ends.tail)) = first + at;
      ends.tail = first + at;
    }
  }
}

void TriangleFans::list(uint32_t vertex, std::vector<Wing>& wings) {
  wings.clear();
  Ends& ends = ends_[vertex];
  uint32_t before = kNone;
  for (uint32_t link = ends.head; link != kNone;) {
    const Face& face = faces_[link / 4];
    const uint32_t at = link % 4, after = face.next[at];
    if (face.corners[0] != kNone) {
      wings.push_back(
          {link / 4, face.corners[at == 2 ? 0 : at + 1], face.corners[at == 0 ? 2 : at - 1]});
      before = link;
    } else {
      (before == kNone ? ends.head : next(before)) = after;
      if (ends.tail == link) ends.tail = before;
    }
    link = after;
  }
}

bool TriangleFans::isClosed(const std::vector<Wing>& wings) {
  for (const Wing& wing : wings) mark_[wing.from] = mark_[wing.to] = 0;
  for (const Wing& wing : wings) {
    mark_[wing.from] += 1;
    mark_[wing.to] += 1u << 16;
  }
  const bool is_closed =
      wings.size() >= 3 && std::all_of(wings.begin(), wings.end(), [&](const Wing& wing) {
        return mark_[wing.from] == 0x10001u && mark_[wing.to] == 0x10001u;
      });
  for (const Wing& wing : wings) mark_[wing.from] = mark_[wing.to] = 0;
  return is_closed;
}

bool TriangleFans::staysManifold(uint32_t u, const std::vector<Wing>& wings, uint32_t v) {
  list(v, wings_);
  ++stamp_;
  for (const Wing& wing : wings_) mark_[wing.from] = mark_[wing.to] = stamp_;
  int common = 0, between = 0;
  for (const Wing& wing : wings) {
    if (wing.from != v && mark_[wing.from] == stamp_) ++common;
    if (wing.from == v || wing.to == v) ++between;
  }
  mark_[u] = 0;
  return common == 2 && between == 2;
}

void TriangleFans::merge(uint32_t u, const std::vector<Wing>& wings, uint32_t v) {
  for (const Wing& wing : wings) {
    Triangle& corners = faces_[wing.triangle].corners;
    if (wing.from == v || wing.to == v) {
      corners = {kNone, kNone, kNone};
    } else {
      *std::find(corners.begin(), corners.end(), u) = v;
    }
  }
  Ends &from = ends_[u], &to = ends_[v];
  next(to.tail) = from.head;
  to.tail = from.tail;
  from = {};
}

}  // namespace dtsdf
