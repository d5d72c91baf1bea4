#include "cpu/loose_units.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include "cpu/widest_vectors.h"
#include "cpu/window_words.h"

namespace dtsdf {
namespace {

/// Units of a window, see window_words.h.
using Window = std::array<uint64_t, kWindowWords>;

template <class Words>
bool isEmpty(const Words& words) {
  return std::all_of(words.begin(), words.end(), [](uint64_t word) { return word == 0; });
}

template <class Words>
void add(const Words& some, Words& to) {
  for (size_t w = 0; w < to.size(); ++w) to[w] |= some[w];
}

template <class Words>
void remove(const Words& some, Words& from) {
  for (size_t w = 0; w < from.size(); ++w) from[w] &= ~some[w];
}

template <class Words>
Words intersection(Words some, const Words& others) {
  for (size_t w = 0; w < some.size(); ++w) some[w] &= others[w];
  return some;
}

/// The first one only. @pre there is one.
template <class Words>
Words firstUnit(const Words& words) {
  Words first = {};
  size_t w = 0;
  while (words[w] == 0) ++w;
  first[w] = words[w] & (uint64_t{0} - words[w]);
  return first;
}

/// The units of the block that are among some or share a face with one.
BlockBits grown(const BlockBits& units) {
  constexpr uint64_t kFirstOfRows = 0x0101010101010101u;
  BlockBits result;
  for (int z = 0; z < kBlockSide; ++z) {
    const uint64_t own = units[z];
    result[z] = own | (own << 1 & ~kFirstOfRows) | (own >> 1 & ~(kFirstOfRows << 7)) | own << 8 |
                own >> 8 | (z > 0 ? units[z - 1] : 0) | (z + 1 < kBlockSide ? units[z + 1] : 0);
  }
  return result;
}

/// A window that grows along one axis.
Window grownAlongX(Window units) {
  for (uint64_t& word : units) word = dtsdf::grownAlongX(word);
  return units;
}

Window grownAlongY(const Window& units) {
  Window result;
  for (int w = 0; w < kWindowWords; ++w) {
    const int y = w % kWordsPerLayer;
    result[w] = dtsdf::grownAlongY(units[w], y > 0 ? units[w - 1] : 0,
                                   y + 1 < kWordsPerLayer ? units[w + 1] : 0);
  }
  return result;
}

Window grownAlongZ(Window units) {
  const Window before = units;
  for (int w = kWordsPerLayer; w < kWindowWords; ++w) {
    units[w] |= before[w - kWordsPerLayer];
    units[w - kWordsPerLayer] |= before[w];
  }
  return units;
}

inline Window grown(const Window& units) {
  Window result;
  for (int first = 0; first < kWindowWords; first += kWordsPerLayer) {
    const uint64_t* layer = units.data() + first;
    for (int w = 0; w < kWordsPerLayer; ++w) {
      const uint64_t before = w > 0 ? layer[w - 1] : 0;
      const uint64_t after = w + 1 < kWordsPerLayer ? layer[w + 1] : 0;
      const uint64_t below = first > 0 ? layer[w - kWordsPerLayer] : 0;
      const uint64_t above = first + kWordsPerLayer < kWindowWords ? layer[w + kWordsPerLayer] : 0;
      result[first + w] = dtsdf::grownAlongX(layer[w]) |
                          dtsdf::grownAlongY(layer[w], before, after) | below | above;
    }
  }
  return result;
}

/// All of the surface that is joined to `piece` over faces.
template <class Words>
Words joinedOverFaces(const Words& surface, Words piece) {
  for (;;) {
    const Words next = intersection(grown(piece), surface);
    if (next == piece) return piece;
    piece = next;
  }
}

/// Of a block, as if nothing were around it.
Shadow shadowOf(const BlockBits& piece) {
  uint64_t all = 0;
  Shadow shadow = {0, 0, 0};
  for (int z = 0; z < kBlockSide; ++z) {
    all |= piece[z];
    shadow.z |= piece[z] != 0 ? 1u << z : 0u;
  }
  for (int y = 0; y < kBlockSide; ++y) {
    const auto row = static_cast<uint32_t>(all >> (kBlockSide * y) & 0xffu);
    shadow.x |= row;
    shadow.y |= row != 0 ? 1u << y : 0u;
  }
  return shadow;
}

Shadow shadowOf(const Window& piece) {
  Shadow shadow = {0, 0, 0};
  for (int w = 0; w < kWindowWords; ++w) {
    const Shadow part = shadowOfWord(piece[w], w);
    shadow = {shadow.x | part.x, shadow.y | part.y, shadow.z | part.z};
  }
  return shadow;
}

/// The units of pieces that look small within the block, of which most blocks have none.
BlockBits unitsInDoubt(const BlockBits& surface, int most_units) {
  BlockBits in_doubt = {}, rest = surface;
  while (!isEmpty(rest)) {
    const BlockBits piece = joinedOverFaces(surface, firstUnit(rest));
    if (isSmall(shadowOf(piece), most_units)) add(piece, in_doubt);
    remove(piece, rest);
  }
  return in_doubt;
}

/// Rows of a block: their shift in its layer, and the word and the shift that they have in its
/// window.
struct PlaceOfRow {
  int in_layer, word, first_bit;
};

PlaceOfRow placeOfRow(int y, int z) {
  const int row = windowRow(y, z);
  return {kBlockSide * y, row / kRowsPerWord, kWindowSide * (row % kRowsPerWord) + kMostLooseUnits};
}

Window windowAround(const BlockBits& units) {
  Window window = {};
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; units[z] != 0 && y < kBlockSide; ++y) {
      const PlaceOfRow place = placeOfRow(y, z);
      window[place.word] |= (units[z] >> place.in_layer & 0xffu) << place.first_bit;
    }
  }
  return window;
}

BlockBits unitsOfBlock(const Window& window) {
  BlockBits units = {};
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) {
      const PlaceOfRow place = placeOfRow(y, z);
      units[z] |= (window[place.word] >> place.first_bit & 0xffu) << place.in_layer;
    }
  }
  return units;
}

uint64_t fourLabels(const UnitLabels* labels) {
  uint64_t four;
  static_assert(sizeof(four) == 4 * sizeof(UnitLabels), "a word");
  std::memcpy(&four, labels, sizeof(four));
  return four;
}

/// The pieces around a block.
class PiecesAround {
 public:
  PiecesAround(const LabelNeighbourhood& labels, int most_units)
      : labels_(labels), most_units_(most_units) {
    for (int n = 0; n < kBlocksAround; ++n) {
      if (labels[n] != nullptr) enter(labels[n], aroundOffset(n));
    }
  }

  UnitLabels operator()(const Vec3i& unit) const {
    const UnitSource source = unitSource(unit);
    const UnitLabels* block = labels_[source.block];
    return block == nullptr ? UnitLabels{0, 0} : block[source.unit];
  }

  bool isSmall(const Window& piece) const { return dtsdf::isSmall(shadowOf(piece), most_units_); }

  /// The piece of some units over faces; and over edges as well. Once it is not small, a part of
  /// it.
  Window overFaces(Window units) const {
    for (;;) {
      Window next = intersection(grown(intersection(grown(units), surface_)), surface_);
      if (next == units || !isSmall(next)) return next;
      units = next;
    }
  }
  Window overEdges(Window piece) const {
    while (isSmall(piece) && growOverEdges(piece)) piece = overFaces(piece);
    return piece;
  }

  /// Places that are no farther along any axis from a piece that is not small.
  Window besideLarger() const {
    Window rest = surface_, places = {};
    while (!isEmpty(rest)) {
      Window piece = overFaces(firstUnit(rest));
      if (!isSmall(piece)) {
        piece = joinedOverFaces(surface_, piece);
        add(piece, places);
      }
      remove(piece, rest);
    }
    for (int i = 0; i < most_units_; ++i) places = grownAlongX(grownAlongY(grownAlongZ(places)));
    return places;
  }

 private:
  /// Along an axis: what of a block at such an offset lies in the window.
  struct Range {
    int first, end;
  };
  static Range rangeOf(int offset) {
    return {offset < 0 ? kBlockSide - kMostLooseUnits : 0,
            offset > 0 ? kMostLooseUnits : kBlockSide};
  }

  void enter(const UnitLabels* labels, const Vec3i& offset) {
    const Range xs = rangeOf(offset.x), ys = rangeOf(offset.y), zs = rangeOf(offset.z);
    for (int z = zs.first; z < zs.end; ++z) {
      for (int y = ys.first; y < ys.end; ++y) {
        const PlaceOfRow place = placeOfRow(y + kBlockSide * offset.y, z + kBlockSide * offset.z);
        for (int x = xs.first; x < xs.end; x += 4) {
          const uint64_t bits = surfaceBits(fourLabels(labels + voxelIndex(x, y, z)));
          surface_[place.word] |= bits << (place.first_bit + x + kBlockSide * offset.x);
        }
      }
    }
  }

  bool growOverEdges(Window& piece) const {
    const Window before = piece;
    for (int w = 0; w < kWindowWords; ++w) {
      for (int bit = 0; bit < 64 && before[w] >> bit != 0; ++bit) {
        if ((before[w] >> bit & 1u) == 0) continue;
        visitOverEdges(*this, windowUnit(w, bit),
                       [&](const Vec3i& other) { piece[windowWord(other)] |= windowBit(other); });
      }
    }
    return piece != before;
  }

  const LabelNeighbourhood& labels_;
  const int most_units_;
  Window surface_ = {};
};

inline BlockBits findLooseUnits(const BlockBits& surface, const LabelNeighbourhood& labels,
                                int most_units) {
  BlockBits loose = {}, in_doubt = unitsInDoubt(surface, most_units);
  if (isEmpty(in_doubt)) return loose;
  const PiecesAround pieces(labels, most_units);
  std::optional<Window> beside_larger;  // once it is asked for, which is rare
  while (!isEmpty(in_doubt)) {
    const Window over_faces = pieces.overFaces(windowAround(firstUnit(in_doubt)));
    const Window piece = pieces.overEdges(over_faces);
    const BlockBits own = unitsOfBlock(piece);
    if (pieces.isSmall(piece)) {
      if (!beside_larger) beside_larger = pieces.besideLarger();
      Window apart = piece;
      remove(*beside_larger, apart);
      if (apart != piece) add(own, loose);
    }
    remove(own, in_doubt);
  }
  return loose;
}

}  // namespace

BlockBits looseUnits(const BlockBits& surface, const LabelNeighbourhood& labels, int most_units) {
  BlockBits loose = {};
  if (most_units == 0) return loose;
  withWidestVectors([&] { loose = findLooseUnits(surface, labels, most_units); });
  return loose;
}

}  // namespace dtsdf
