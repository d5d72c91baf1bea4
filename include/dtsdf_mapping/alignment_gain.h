/// Determines how closely refined poses follow noisy alignments.
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace dtsdf {

/// Estimates whether given poses or alignments have the larger random errors. Alignments of coarse
/// or warped depth, such as a phone's, may scatter by a centimetre while odometry is smooth;
/// refined poses then follow alignments only on average.
///
/// Independent errors show in third differences, which smooth motion and drift hardly affect. Third
/// differences of the given poses bound the errors of these poses. Third differences of the
/// corrections contain the errors of both; any excess comes from the alignments. Not thread safe.
class AlignmentGain {
 public:
  /// Adds the next given pose, camera to odometry.
  void addGiven(const Eigen::Isometry3d& T_O_C);

  /// Adds the aligned pose, camera to map, that belongs to the last given pose. @return whether the
  /// correction jumped, which makes earlier corrections worthless.
  bool addAligned(const Eigen::Isometry3d& T_W_C);

  /// Fraction of the step from the expected to the aligned pose that the refined pose takes: 1
  /// unless alignments are known to be noisy. For steps larger than the noise of alignments, the
  /// fraction grows with the step.
  double share(const Eigen::Isometry3d& expected_T_W_C,
               const Eigen::Isometry3d& aligned_T_W_C) const;

 private:
  /// Translation in metres, then a rotation in radians.
  using Step = Eigen::Matrix<double, 6, 1>;

  /// Variance of a trajectory's independent errors, summed over axes and averaged over recent
  /// images.
  struct Variance {
    double m2 = 0.0, rad2 = 0.0;
    int seen = 0;
    std::optional<Step> last, before;

    /// Adds the next step. @return whether the trajectory jumped: the step's third difference
    /// exceeds what noise explains.
    bool add(const Step& step);
    bool isKnown() const;
  };

  Variance given_, aligned_;
  std::optional<Eigen::Isometry3d> T_O_C_, T_W_O_;
};

}  // namespace dtsdf
