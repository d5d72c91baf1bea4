/// A mapper's space, for Python.
#pragma once

#include <memory>

#include "python/mapper_session.h"

namespace dtsdf::python {

/// Keeps its mapper.
struct SpaceView {
  std::shared_ptr<MapperSession> session;
};

}  // namespace dtsdf::python
