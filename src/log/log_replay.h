/// What is in a log, for a mapper: each image at its corrected pose, and the calls between them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "log/logged_poses.h"

namespace dtsdf {

/// An image, or a region that was emptied.
struct LogCall {
  std::variant<LoggedDepth, LoggedColour, Region> content;
  double stamp_s = 0.0;  ///< Of an image.
  uint64_t number = 0;   ///< Of the record.
};

/// One thread at a time.
class LogReplay {
 public:
  /// Reads the whole log, but for the pixels. @throws std::runtime_error as LogReader does.
  explicit LogReplay(const std::string& folder);

  const LogReader& log() const { return reader_; }
  const LoggedPoses& poses() const { return poses_; }

  /// The settings of the mapper; where it runs is not among them.
  const ParamTree& settings() const { return reader_.begin().settings; }

  // As of LoggedPoses. What was handed out at other poses stays so: see startOver().
  CorrectionEffect effectOf(const LogCorrection& correction) const;
  CorrectionEffect correct(const LogCorrection& correction);

  /// Hands out all again that has gone into the newest map of the log which has nothing of the
  /// record with this number or later ones. @return the file of that map; empty: it is empty.
  std::string startOver(uint64_t number);

  /// Reads what was logged since. @return whether there was something.
  bool readOn();

  /// What comes next; nothing at the end of what was read. @throws std::runtime_error for a record
  /// that is damaged.
  std::optional<LogCall> next();

  /// Level of the map, as it was known last.
  const std::optional<Eigen::Isometry3d>& level() const { return T_W_M_; }

  /// Those that are handed out, from the start on.
  size_t depthImages() const { return depth_images_; }

  /// The number of the record that comes after those so far.
  uint64_t nextNumber() const;
  /// Whether one with this number was handed out.
  bool isHandedOut(uint64_t number) const;

 private:
  void outdate(const LogCorrection& correction);

  LogReader reader_;
  LoggedPoses poses_;
  std::optional<Eigen::Isometry3d> T_W_M_;
  std::vector<LogBase> bases_;  ///< Those of the log that no correction in it has outdated.
  size_t bases_read_;           ///< How many of the log there are to it so far.
  size_t depth_images_ = 0;
  size_t next_ = 0;
};

/// Has a mapper do what the call was. Colours and depth give their result, a region kFused.
IntegrationResult apply(const LogCall& call, Mapper& mapper);

}  // namespace dtsdf
