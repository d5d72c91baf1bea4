/// The step that writes what happens to the map into the journal.
#pragma once

#include <memory>
#include <optional>

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

  /// For corrections, which are written to it and made of it.
  JournalWriter& writer() { return writer_; }

 private:
  void begin(std::shared_ptr<const MapChunks> map);

  const Host& host_;
  MapperParams params_;                     ///< Of the map as it is.
  std::optional<Eigen::Isometry3d> level_;  ///< That is in the journal.
  JournalWriter writer_;
};

}  // namespace dtsdf
