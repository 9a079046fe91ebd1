// The program's own importer reads what the program writes.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>

#include "server/dicom_out/phantom_series.h"
#include "server/import/import.h"

namespace spinaltap::dicom_out {
namespace {

namespace fs = std::filesystem;

TEST(PhantomSeries, IsImportedWithTheSameGridAndHu) {
  std::string name = (fs::temp_directory_path() / "dicom_round_XXXXXX").string();
  const fs::path folder = mkdtemp(name.data());
  for (const bool osteoporotic : {false, true}) {
    PhantomSeriesOptions options;
    options.phantom = {5, osteoporotic};
    options.ct = phantom::CtOptions::coarser(8);
    const fs::path series = folder / (osteoporotic ? "weak" : "strong");
    ASSERT_TRUE(writePhantomSeries(series, options));
    importer::ImportRequest request;
    request.from = series;
    const auto imported = importer::importVolume(request);
    ASSERT_TRUE(imported) << imported.error().message;
    const auto ct = phantom::sampleCt(phantom::Phantom::make(options.phantom), options.ct).value();
    EXPECT_EQ(imported->ct.grid.dims, ct.grid.dims);
    EXPECT_EQ(imported->ct.hu, ct.hu);
    // Positions were written with nine digits or more; spacing along z is derived from them.
    const Vec3 far{63, 63, 11};
    EXPECT_LT(norm(imported->ct.grid.toPatient(far) - ct.grid.toPatient(far)), 1e-5);
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
}

}  // namespace
}  // namespace spinaltap::dicom_out
