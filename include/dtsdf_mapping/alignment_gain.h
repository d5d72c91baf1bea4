/// How far poses follow what images are aligned to.
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace dtsdf {

/// Finds out whether given poses or alignments vary more at random from image to image. Coarse or
/// warped depth, as a phone's, is aligned to a centimetre here and there while odometry is smooth:
/// then alignments are followed on average only.
///
/// Independent errors show in third differences, which leave smooth motion and smooth drift out.
/// Those of the given way bound the given poses' errors; those of the corrections have both, so
/// what they have more is of the alignments. Not thread safe.
class AlignmentGain {
 public:
  /// The next given pose, camera to odometry.
  void addGiven(const Eigen::Isometry3d& T_O_C);

  /// What the last given pose was aligned to, camera to map. @return whether the correction has
  /// jumped, so that nothing before it counts.
  bool addAligned(const Eigen::Isometry3d& T_W_C);

  /// The share of the way from the expected pose to the aligned one that an image is to be moved:
  /// 1 unless alignments are known to be noisy and the way is within their noise.
  double share(const Eigen::Isometry3d& expected_T_W_C,
               const Eigen::Isometry3d& aligned_T_W_C) const;

 private:
  /// Translation in metres, then a rotation in radians.
  using Step = Eigen::Matrix<double, 6, 1>;

  /// The independent errors of a way, as means of squares over its last images, summed over axes.
  struct Variance {
    double m2 = 0.0, rad2 = 0.0;
    int seen = 0;
    std::optional<Step> last, before;

    /// The next step of the way. @return whether it is too long for noise.
    bool add(const Step& step);
    bool isKnown() const;
  };

  static Step stepBetween(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

  Variance given_, aligned_;
  std::optional<Eigen::Isometry3d> T_O_C_, T_W_O_;
};

}  // namespace dtsdf
