/// How far refined poses follow noisy alignments.
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace dtsdf {

/// Estimates whether given poses or alignments have the larger random errors. Alignments of coarse
/// or warped depth, such as a phone's, may scatter by a centimetre while odometry is smooth; then
/// poses follow alignments on average only.
///
/// Independent errors show in third differences, which smooth motion and drift do not affect. Those
/// of the given poses bound the given poses' errors; those of the corrections contain both errors,
/// so the excess is that of the alignments. Not thread safe.
class AlignmentGain {
 public:
  /// The next given pose, camera to odometry.
  void addGiven(const Eigen::Isometry3d& T_O_C);

  /// The aligned pose of the image given last, camera to map. @return whether the correction has
  /// jumped, so that earlier ones no longer count.
  bool addAligned(const Eigen::Isometry3d& T_W_C);

  /// The share of the way from the expected to the aligned pose by which to move an image: 1 unless
  /// alignments are known to be noisy and the way is within their noise.
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

  Variance given_, aligned_;
  std::optional<Eigen::Isometry3d> T_O_C_, T_W_O_;
};

}  // namespace dtsdf
