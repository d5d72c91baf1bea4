#include "ros/steps/make_steps.h"

#include <utility>

#include "ros/steps/correct.h"
#include "ros/steps/journal.h"
#include "ros/steps/level.h"
#include "ros/steps/poses.h"
#include "ros/steps/space.h"

namespace dtsdf {

Steps makeSteps(const Host& host) {
  const bool has_journal = !host.params.journal_folder.empty();
  auto journal = has_journal ? std::make_unique<JournalStep>(host) : nullptr;
  Steps steps;
  steps.push_back(std::make_unique<LevelStep>(host.params, host.transforms, host.frame));
  steps.push_back(std::make_unique<PosesStep>(host));
  steps.push_back(std::make_unique<CorrectStep>(host, journal ? &journal->writer() : nullptr));
  if (journal) steps.push_back(std::move(journal));
  steps.push_back(makeMeshTopicsStep(host.params, host.mesh_hz));
  steps.push_back(makePointsStep(host));
  auto space = std::make_unique<SpaceStep>(host);
#ifdef DTSDF_WITH_OCTOMAP_MSGS
  if (host.params.mapper.space.enabled) steps.push_back(makeOctomapStep(host, *space));
#endif
  steps.push_back(std::move(space));
  steps.push_back(makeViewStep(host));
  steps.push_back(makeFilesStep(host));
  return steps;
}

}  // namespace dtsdf
