/// The steps that write what happens to the map into the journal.
#pragma once

#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "journal/writer.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// With journal/folder. It waits for nobody.
class JournalStep : public Step {
 public:
  /// @throws std::runtime_error as JournalWriter does.
  explicit JournalStep(const Host& host);

  void fused(const PosedFrame& frame, const IntegrationResult& result) override;
  void regionCleared(const Region& region) override { writer_.add(region); }
  void replaced(const Replacement& replacement) override;
  void fill(dtsdf_mapping::MapStatus& status) override;

  /// The pose of the frame that is fused next, as it was given.
  void given(const Eigen::Isometry3d& T_W_C) { given_ = T_W_C; }
  /// The map became that of corrected poses.
  void corrected(const journal::Correction& correction) { writer_.add(correction); }

  // See JournalWriter.
  const std::string& path() const { return writer_.path(); }
  uint64_t count() const { return writer_.count(); }
  std::future<bool> written() { return writer_.written(); }
  /// Why the map cannot be made of the journal; empty: it can.
  std::string problem() const { return writer_.report().problem; }

 private:
  void begin(std::shared_ptr<const MapChunks> map);

  const Host& host_;
  MapperParams params_;                     ///< Of the map as it is.
  std::optional<Eigen::Isometry3d> level_;  ///< That is in the journal.
  Eigen::Isometry3d given_ = Eigen::Isometry3d::Identity();
  JournalWriter writer_;
};

/// Goes where frames have the poses that they were given.
class GivenPoseStep : public Step {
 public:
  explicit GivenPoseStep(JournalStep& journal) : journal_(journal) {}
  std::optional<Rejection> place(PosedFrame& frame) override;

 private:
  JournalStep& journal_;
};

}  // namespace dtsdf
