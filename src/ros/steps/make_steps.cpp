#include "ros/steps/make_steps.h"

#include <memory>
#include <utility>

#include "ros/steps/correct.h"
#include "ros/steps/journal.h"
#include "ros/steps/level.h"
#include "ros/steps/mesh_topics.h"
#include "ros/steps/points.h"
#include "ros/steps/poses.h"
#include "ros/steps/space.h"
#include "ros/steps/view.h"

namespace dtsdf {

Steps makeSteps(const Host& host, FilesStep*& files) {
  auto journal =
      host.params.node.journal.folder.empty() ? nullptr : std::make_unique<JournalStep>(host);
  JournalStep* const journal_step = journal.get();
  auto files_step = std::make_unique<FilesStep>(host);
  files = files_step.get();
  Steps steps;
  steps.push_back(std::make_unique<LevelStep>(host.params, host.transforms, host.frame));
  if (journal) steps.push_back(std::make_unique<GivenPoseStep>(*journal));
  steps.push_back(std::make_unique<PosesStep>(host));
  steps.push_back(std::make_unique<CorrectStep>(host, journal_step));
  if (journal) steps.push_back(std::move(journal));
  steps.push_back(std::make_unique<MeshTopicsStep>(host.params, host.rates));
  steps.push_back(std::make_unique<PointsStep>(host));
  steps.push_back(std::make_unique<SpaceStep>(host));
  steps.push_back(std::make_unique<ViewStep>(host));
  steps.push_back(std::move(files_step));
  return steps;
}

}  // namespace dtsdf
