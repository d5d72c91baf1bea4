// Loose pieces of a block, against their definition.
#include "cpu/loose_units.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <vector>

namespace dtsdf {
namespace {

constexpr int kFirst = -kBlockSide, kSide = 3 * kBlockSide;
/// The units of a block, (0, 0, 0) its first one, and of those around it.
class Units {
 public:
  Units() {
    for (std::vector<UnitLabels>& block : labels_) block.assign(kVoxelsPerBlock, {0, 0});
  }

  void set(const Vec3i& unit, const UnitLabels& labels) { at(unit) = labels; }
  static bool isThere(const Vec3i& unit) {
    const auto inside = [](int at) { return at >= kFirst && at < kFirst + kSide; };
    return inside(unit.x) && inside(unit.y) && inside(unit.z);
  }
  UnitLabels& at(const Vec3i& unit) {
    constexpr int kMask = kBlockSide - 1;
    return labels_[blockAround(unit)][voxelIndex(unit.x & kMask, unit.y & kMask, unit.z & kMask)];
  }
  bool has(const Vec3i& unit) { return isThere(unit) && holdsSurface(at(unit)); }

  BlockBits loose(int most_units) {
    LabelNeighbourhood all;
    BlockBits surface = {};
    for (int n = 0; n < kBlocksAround; ++n) all[n] = labels_[n].data();
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      if (has(voxelOffset(i))) addUnit(surface, voxelOffset(i));
    }
    return looseUnits(surface, all, most_units);
  }

 private:
  std::vector<UnitLabels> labels_[kBlocksAround];
};

/// The same unit by unit, and edges by their ends.
class Definition {
 public:
  Definition(Units& units, int most_units) : units_(units), most_(most_units) {
    const int end = kBlockSide + kMostLooseUnits;
    for (int z = -kMostLooseUnits; z < end; ++z) {
      for (int y = -kMostLooseUnits; y < end; ++y) {
        for (int x = -kMostLooseUnits; x < end; ++x) {
          if (units_.has({x, y, z})) seen_.push_back({x, y, z});
        }
      }
    }
    for (const Vec3i& unit : seen_) {
      if (contains(larger_, unit)) continue;
      const std::vector<Vec3i> piece = pieceOf(unit, false);
      if (!isSmall(piece)) larger_.insert(larger_.end(), piece.begin(), piece.end());
    }
  }

  bool isLoose(const Vec3i& unit) {
    const std::vector<Vec3i> piece = pieceOf(unit, true);
    const auto isBesideLarger = [&](const Vec3i& own) {
      return std::any_of(larger_.begin(), larger_.end(),
                         [&](const Vec3i& other) { return greatest(own - other) <= most_; });
    };
    return isSmall(piece) && std::any_of(piece.begin(), piece.end(), isBesideLarger);
  }

 private:
  static int greatest(const Vec3i& step) {
    return std::max({std::abs(step.x), std::abs(step.y), std::abs(step.z)});
  }
  static bool contains(const std::vector<Vec3i>& units, const Vec3i& unit) {
    return std::find(units.begin(), units.end(), unit) != units.end();
  }
  bool isSmall(const std::vector<Vec3i>& piece) const {
    for (const Vec3i& a : piece) {
      for (const Vec3i& b : piece) {
        if (greatest(a - b) >= most_) return false;
      }
    }
    return true;
  }

  /// On which side of some sheet of the unit a corner of the grid is.
  bool crosses(const Vec3i& unit, const Vec3i& from, const Vec3i& to) const {
    const auto cornerOf = [&](const Vec3i& point) {
      const Vec3i at = point - unit;
      return at.x + 2 * at.y + 4 * at.z;
    };
    const UnitIndices indices = indicesOf(units_.at(unit));
    for (const uint8_t sheet : indices.sheet) {
      if ((sheet >> cornerOf(from) & 1) != (sheet >> cornerOf(to) & 1)) return true;
    }
    return false;
  }

  bool areJoined(const Vec3i& a, const Vec3i& b, bool over_edges) const {
    const Vec3i step = b - a;
    const int length = std::abs(step.x) + std::abs(step.y) + std::abs(step.z);
    if (length == 1) return true;
    if (!over_edges || length != 2 || greatest(step) != 1) return false;
    const Vec3i from{std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
    const Vec3i to = from + Vec3i{step.x == 0, step.y == 0, step.z == 0};
    return crosses(a, from, to) && crosses(b, from, to);
  }

  std::vector<Vec3i> pieceOf(const Vec3i& unit, bool over_edges) const {
    std::vector<Vec3i> piece = {unit};
    for (size_t i = 0; i < piece.size(); ++i) {
      for (const Vec3i& other : seen_) {
        if (areJoined(piece[i], other, over_edges) && !contains(piece, other)) {
          piece.push_back(other);
        }
      }
    }
    return piece;
  }

  Units& units_;
  const int most_;
  std::vector<Vec3i> seen_, larger_;
};

TEST(LooseUnits, SurfacesAreFoundInFourUnitsAtOnce) {
  for (uint64_t behind = 0; behind < 256; ++behind) {
    for (int place = 0; place < 4; ++place) {
      for (const uint64_t others : {uint64_t{0}, ~uint64_t{0}}) {
        const uint64_t unit = uint64_t{0xffff} << (16 * place);
        const uint64_t labels = (others & ~unit) | behind << (16 * place);
        const bool holds = holdsSurface({static_cast<uint8_t>(behind), 0});
        ASSERT_EQ(surfaceBits(labels), holds ? 1u << place : 0u) << behind << " " << place;
      }
    }
  }
}

TEST(LooseUnits, SpansAreToldByFoldedPlacesToo) {
  for (int first = 0; first < kWindowSide; ++first) {
    for (int places = 1; first + places <= kWindowSide; ++places) {
      const uint32_t bits = ((1u << places) - 1u) << first;
      for (int most = 1; most <= kMostLooseUnits; ++most) {
        EXPECT_EQ(spansMore(bits, most), places > most) << first << " " << places << " " << most;
        EXPECT_EQ(spansMore(folded(bits), most), places > most)
            << first << " " << places << " " << most;
      }
    }
  }
}

TEST(LooseUnits, AreThoseOfTheDefinition) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> anywhere(kFirst, kFirst + kSide - 1), steps(1, 14), way(0, 5);
  std::uniform_int_distribution<int> index(1, 254);
  int loose_units = 0, other_units = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Units units;
    for (int walk = 0; walk < 70; ++walk) {
      Vec3i at{anywhere(random), anywhere(random), anywhere(random)};
      for (int left = steps(random); left > 0; --left) {
        const auto behind = static_cast<uint8_t>(index(random));
        units.set(at, {behind, static_cast<uint8_t>(~behind)});
        const int face = way(random);
        const Vec3i next = at + gridStep(face / 2, face % 2 == 0 ? 1 : -1);
        if (Units::isThere(next)) at = next;
      }
    }
    const int most = 1 + trial % kMostLooseUnits;
    const BlockBits loose = units.loose(most);
    Definition definition(units, most);
    for (int i = 0; i < kVoxelsPerBlock; ++i) {
      const Vec3i unit = voxelOffset(i);
      if (!units.has(unit)) continue;
      const bool is_loose = definition.isLoose(unit);
      ASSERT_EQ(hasUnit(loose, unit), is_loose)
          << trial << ": " << unit.x << " " << unit.y << " " << unit.z;
      ++(is_loose ? loose_units : other_units);
    }
  }
  EXPECT_GT(loose_units, 100);
  EXPECT_GT(other_units, 500);
}

}  // namespace
}  // namespace dtsdf
