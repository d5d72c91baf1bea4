#include "io/formats/folder_format.h"

namespace dtsdf {

const std::vector<FolderFormat>& folderFormats() {
  static const std::vector<FolderFormat> formats{tumFormat(), iclFormat(), sevenScenesFormat(),
                                                 replicaFormat(), scanNetFormat()};
  return formats;
}

}  // namespace dtsdf
