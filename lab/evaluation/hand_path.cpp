#include "evaluation/hand_path.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace dtsdf {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kPace_m_s = 0.5;
constexpr double kRadPerDegree = M_PI / 180.0;

/// A sinusoidal motion along or about an axis of the camera (x right, y down, z forward).
struct Swing {
  int axis;
  double amplitude, frequency_hz;
};

/// Translations in metres: circular hand motion, steps, tremor.
constexpr Swing kSways_m[] = {{0, 0.12, 0.31},  {1, 0.12, 0.31}, {2, 0.06, 0.23},
                              {1, 0.012, 1.8},  {0, 0.008, 0.9}, {0, 0.0008, 6.1},
                              {1, 0.0008, 7.3}, {2, 0.0008, 5.2}};

/// Rotations in degrees: looking up and down, looking around, roll, steps, tremor.
constexpr Swing kTurns_deg[] = {{0, 8.0, 0.17}, {1, 20.0, 0.13}, {2, 15.0, 0.21}, {2, 1.0, 1.8},
                                {0, 0.15, 6.7}, {1, 0.15, 5.9},  {2, 0.15, 7.7}};

/// Sum of sinusoidal motions with random phases.
class Swings {
 public:
  template <size_t kCount>
  Swings(const Swing (&swings)[kCount], std::mt19937_64& random)
      : swings_(swings, swings + kCount) {
    for (size_t i = 0; i < kCount; ++i) {
      phases_.push_back(2.0 * M_PI * static_cast<double>(random() >> 11) * 0x1.0p-53);
    }
  }

  Vector3d at(double time_s) const {
    Vector3d sum = Vector3d::Zero();
    for (size_t i = 0; i < swings_.size(); ++i) {
      const Swing& swing = swings_[i];
      sum(swing.axis) +=
          swing.amplitude * std::sin(2.0 * M_PI * swing.frequency_hz * time_s + phases_[i]);
    }
    return sum;
  }

 private:
  std::vector<Swing> swings_;
  std::vector<double> phases_;
};

/// A closed Catmull-Rom spline through poses, parametrised by chord length.
class Loop {
 public:
  explicit Loop(const std::vector<Isometry3d>& through_T_W_C) : poses_(through_T_W_C) {
    if (poses_.size() < 2) throw std::invalid_argument("a path needs at least two poses");
    ends_m_.push_back(0.0);
    for (size_t i = 0; i < poses_.size(); ++i) {
      ends_m_.push_back(ends_m_.back() +
                        (pose(i + 1).translation() - pose(i).translation()).norm());
    }
    if (!(ends_m_.back() > 0.0)) throw std::invalid_argument("all poses have the same position");
  }

  Isometry3d at(double way_m) const {
    const double on_loop_m = std::fmod(way_m, ends_m_.back());
    const auto end = std::upper_bound(ends_m_.begin() + 1, ends_m_.end() - 1, on_loop_m);
    const auto i = static_cast<size_t>(end - ends_m_.begin()) - 1;
    const double t = std::min((on_loop_m - ends_m_[i]) / std::max(1e-9, *end - ends_m_[i]), 1.0);
    const Vector3d a = pose(i + poses_.size() - 1).translation(), b = pose(i).translation();
    const Vector3d c = pose(i + 1).translation(), d = pose(i + 2).translation();
    Isometry3d T_W_C = Isometry3d::Identity();
    T_W_C.translation() =
        b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)));
    T_W_C.linear() = Eigen::Quaterniond(pose(i).linear())
                         .slerp(t, Eigen::Quaterniond(pose(i + 1).linear()))
                         .normalized()
                         .toRotationMatrix();
    return T_W_C;
  }

 private:
  const Isometry3d& pose(size_t i) const { return poses_[i % poses_.size()]; }

  std::vector<Isometry3d> poses_;
  /// Total chord length up to each pose, then that of the whole loop.
  std::vector<double> ends_m_;
};

}  // namespace

std::vector<Isometry3d> handPoses(const std::vector<Isometry3d>& through_T_W_C,
                                  const HandPath& path) {
  const Loop loop(through_T_W_C);
  std::mt19937_64 random(path.seed);
  const Swings sways(kSways_m, random), turns(kTurns_deg, random);
  std::vector<Isometry3d> poses_W_C;
  for (size_t i = 0; i < path.count; ++i) {
    const double time_s = static_cast<double>(i) / path.rate_hz;
    const Vector3d turn = kRadPerDegree * turns.at(time_s);
    Isometry3d T_W_C = loop.at(kPace_m_s * time_s);
    T_W_C.translate(sways.at(time_s));
    T_W_C.rotate(AngleAxisd(turn.y(), Vector3d::UnitY()) * AngleAxisd(turn.x(), Vector3d::UnitX()) *
                 AngleAxisd(turn.z(), Vector3d::UnitZ()));
    poses_W_C.push_back(T_W_C);
  }
  return poses_W_C;
}

}  // namespace dtsdf
