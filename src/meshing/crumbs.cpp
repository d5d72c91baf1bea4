#include <algorithm>
#include <set>
#include <unordered_map>

#include "meshing/mend.h"

namespace dtsdf {
namespace {

/// Pieces with more triangles are not crumbs (see mend.h). In a refined mesh, the limit is
/// four times as large.
constexpr size_t kMaxCrumb = 16;
/// A small piece is kept unless a larger piece lies within this distance along each axis, in
/// voxels.
constexpr float kCrumbReach = 4.0f;
/// A small piece is also kept if it and the small pieces within this distance (in voxels) together
/// have too many triangles for a crumb, like the pieces of a narrow slat.
constexpr float kNextPiece = 1.5f;

constexpr uint32_t kNoPiece = UINT32_MAX;

/// A piece with few triangles.
struct Piece {
  std::vector<uint32_t> vertices;  ///< Begins with its lowest vertex on an outline.
  size_t triangles = 0, max_triangles = 0;
  Vec3f low = {}, high = {};  ///< Bounds of the piece, enlarged by kCrumbReach.
  bool is_near_larger = false;
  std::set<uint32_t> next_to;  ///< Indices of the small pieces near it.
};

/// Lists the vertices of a piece, starting from its lowest vertex on an outline, and marks them
/// with the piece's index. In a small piece, at least one end of every edge has an Outline::Rim,
/// which lists the triangles at that end. @return whether the piece is small.
bool grow(const Outline& outline, uint32_t number, std::vector<uint32_t>& piece_of, Piece& piece) {
  const uint32_t first = outline.first(), lowest = piece.vertices[0];
  const auto isPossible = [&](uint32_t v) {
    return v >= first && outline.kind(v) != Outline::Kind::kFixed &&
           (v >= lowest || !outline.isOnOutline(v));
  };
  for (size_t n = 0; n < piece.vertices.size(); ++n) {
    const uint32_t v = piece.vertices[n];
    if (outline.kind(v) == Outline::Kind::kMiddle) piece.max_triangles = 4 * kMaxCrumb;
    if (!outline.hasRim(v)) continue;
    const Outline::Rim& rim = outline.rimOf(v);
    for (uint32_t i = 0; i < rim.own; ++i) {
      const auto [a, b] = outline.linksOf(rim)[i];
      if (!isPossible(a) || !isPossible(b)) return false;
      const bool has_rim[] = {outline.hasRim(a), outline.hasRim(b)};
      if (!has_rim[0] && !has_rim[1]) return false;
      // Each triangle is counted at its lowest vertex that has a rim.
      if ((!has_rim[0] || a > v) && (!has_rim[1] || b > v)) ++piece.triangles;
      for (const uint32_t other : {a, b}) {
        if (piece_of[other - first] == number) continue;
        piece_of[other - first] = number;
        piece.vertices.push_back(other);
      }
    }
    if (piece.triangles > piece.max_triangles) return false;
  }
  return true;
}

/// Finds all small pieces. @param piece_of Receives the index of each vertex's piece, or kNoPiece.
std::vector<Piece> findSmallPieces(const Outline& outline, std::vector<uint32_t>& piece_of) {
  std::vector<Piece> pieces;
  Piece piece;
  for (const Outline::Rim& rim : outline.rims()) {
    if (rim.own == 0 || !outline.isOnOutline(rim.vertex)) continue;
    const auto isHigher = [&](const auto& fan) { return std::min(fan[0], fan[1]) > rim.vertex; };
    if (!std::all_of(rim.fans.begin(), rim.fans.begin() + rim.fan_count, isHigher)) continue;
    uint32_t& own = piece_of[rim.vertex - outline.first()];
    if (own != kNoPiece) continue;
    own = static_cast<uint32_t>(pieces.size());
    piece.vertices.assign(1, rim.vertex);
    piece.triangles = 0;
    piece.max_triangles = kMaxCrumb;
    if (grow(outline, own, piece_of, piece)) {
      pieces.push_back(piece);
    } else {
      for (const uint32_t v : piece.vertices) piece_of[v - outline.first()] = kNoPiece;
    }
  }
  return pieces;
}

}  // namespace

void removeCrumbs(Outline& outline, uint32_t first, uint32_t end,
                  const std::vector<Vec3f>& positions, float voxel) {
  if (first == end) return;
  const uint32_t first_kept = outline.first();
  std::vector<uint32_t> piece_of(outline.end() - first_kept, kNoPiece);
  std::vector<Piece> pieces = findSmallPieces(outline, piece_of);
  const float reach = kCrumbReach * voxel, cell_side = 2.0f * reach;
  const Vec3f margin{reach, reach, reach};
  std::unordered_map<PackedKey, std::vector<uint32_t>> pieces_at;  // the pieces near each cell
  size_t alone = 0;  // pieces that are not yet known to be near a larger one
  for (uint32_t n = 0; n < pieces.size(); ++n) {
    Piece& piece = pieces[n];
    if (piece.vertices[0] < first || piece.vertices[0] >= end) continue;
    piece.low = piece.high = positions[piece.vertices[0] - first_kept];
    ++alone;
    for (const uint32_t v : piece.vertices) {
      piece.low = minOf(piece.low, positions[v - first_kept] - margin);
      piece.high = maxOf(piece.high, positions[v - first_kept] + margin);
    }
    const Vec3i begin = cellOf(piece.low, cell_side), last = cellOf(piece.high, cell_side);
    for (Vec3i cell = begin; cell.z <= last.z; ++cell.z) {
      for (cell.y = begin.y; cell.y <= last.y; ++cell.y) {
        for (cell.x = begin.x; cell.x <= last.x; ++cell.x) pieces_at[packKey(cell)].push_back(n);
      }
    }
  }
  if (pieces_at.empty()) return;
  Vec3i cell{0, 0, 0};
  auto found = pieces_at.find(packKey(cell));
  for (uint32_t i = first_kept; i < outline.end(); ++i) {
    const uint32_t own = piece_of[i - first_kept];
    if (own == kNoPiece && (alone == 0 || outline.isUnused(i))) continue;
    const Vec3f& p = positions[i - first_kept];
    const Vec3i next = cellOf(p, cell_side);
    if (next != cell) found = pieces_at.find(packKey(next));  // rare, as neighbours share cells
    cell = next;
    if (found == pieces_at.end()) continue;
    for (const uint32_t n : found->second) {
      Piece& piece = pieces[n];
      if (own == n || (own == kNoPiece && piece.is_near_larger)) continue;
      const Vec3f inside = minOf(p - piece.low, piece.high - p);
      const float depth = std::min({inside.x, inside.y, inside.z});
      if (own == kNoPiece) {
        piece.is_near_larger = depth >= 0.0f;
        if (piece.is_near_larger) --alone;
      } else if (depth >= reach - kNextPiece * voxel) {
        piece.next_to.insert(own);
      }
    }
  }
  for (const Piece& piece : pieces) {
    size_t together = piece.triangles;
    for (const uint32_t other : piece.next_to) together += pieces[other].triangles;
    if (!piece.is_near_larger || together > piece.max_triangles) continue;
    for (const uint32_t v : piece.vertices) outline.clear(v);
  }
}

}  // namespace dtsdf
