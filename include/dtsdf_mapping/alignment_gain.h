/// Decides how closely refined poses follow noisy alignments.
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace dtsdf {

/// Compares the random errors of the input poses with those of the alignments. Alignments of coarse
/// or warped depth images, such as those of a phone, may scatter by a centimetre while odometry is
/// smooth. A refined pose then moves only part of the way to its aligned pose.
///
/// Third differences of a trajectory reveal independent errors, because smooth motion and drift
/// hardly affect them. Third differences of the input poses bound the errors of these poses. Third
/// differences of the corrections contain the errors of input poses and alignments, so any excess
/// comes from the alignments. Not thread safe.
class AlignmentGain {
 public:
  /// Adds the next input pose (camera to odometry).
  void addGiven(const Eigen::Isometry3d& T_O_C);

  /// Adds the aligned pose (camera to map) of the image whose input pose was added last. @return
  /// whether the correction jumped, which invalidates earlier corrections.
  bool addAligned(const Eigen::Isometry3d& T_W_C);

  /// Fraction of the step from the expected to the aligned pose by which the refined pose moves. It
  /// is 1 unless alignments are known to be noisy. For steps larger than the noise of alignments,
  /// the fraction grows with the step.
  double share(const Eigen::Isometry3d& expected_T_W_C,
               const Eigen::Isometry3d& aligned_T_W_C) const;

 private:
  /// Translation in metres and rotation vector in radians.
  using Step = Eigen::Matrix<double, 6, 1>;

  /// Variance of the independent errors in a trajectory, summed over axes and averaged over recent
  /// images.
  struct Variance {
    double m2 = 0.0, rad2 = 0.0;
    int seen = 0;
    std::optional<Step> last, before;

    /// Adds the next step. @return whether the trajectory jumped: the third difference of the step
    /// is larger than noise can account for.
    bool add(const Step& step);
    bool isKnown() const;
  };

  Variance given_, aligned_;
  std::optional<Eigen::Isometry3d> T_O_C_, T_W_O_;
};

}  // namespace dtsdf
