#pragma once
// Typed reading from an open HDF5 file. Numbers of any width are converted by HDF5 itself; texts may be of
// fixed or variable length, in datasets, attributes and table columns alike.
//
// A file may come from anywhere. What it claims is held against what it has before memory is taken: no link leads out of it, no
// dataset's values lie in another file, no dataset has more rows than its bytes can hold or a packed chunk of more bytes than are
// unpacked at a time, all that is read together is no more than a recording of its size may be, and no plug-in is loaded to read it.
//
// Errors: every member throws InputError naming the file and the object that is missing or of the wrong kind.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/run.hpp"
#include "protocol/runfile/series.hpp"

namespace diastole::runfile {

class H5Source {
 public:
  explicit H5Source(const std::filesystem::path& path) : name_(path.string()) {
    H5Eset_auto2(H5E_DEFAULT, nullptr,
                 nullptr);  // failures are reported by fail(), not printed by the library
    if (!std::filesystem::is_regular_file(path)) {
      fail("", std::filesystem::is_directory(path) ? "cannot be opened: it is a folder" : "cannot be opened",
           "Check the path and that you may read the file.");
    }
    if (::access(name_.c_str(), R_OK) != 0) {
      fail("", "cannot be read", "Check that you may read the file.");
    }
    if (H5Fis_hdf5(name_.c_str()) <= 0) {
      fail("", "is not an HDF5 file", "Give a run file (NAME.run.h5).");
    }
    H5PLset_loading_state(0);  // filters and links that only a plug-in knows are not for run files
    file_ = FileHandle(H5Fopen(name_.c_str(), H5F_ACC_RDONLY, with_small_cache().get()));
    if (!file_.valid()) {
      fail("", "is an HDF5 file that cannot be read",
           "It is truncated or still being written; if its journal exists, use `diastole recover`.");
    }
    bytes_ = std::filesystem::file_size(path);
    expect_own_links();
  }

  [[nodiscard]] bool has(const std::string& path) const {
    for (size_t slash = path.find('/', 1); slash != std::string::npos; slash = path.find('/', slash + 1)) {
      if (H5Lexists(file_.get(), path.substr(0, slash).c_str(), H5P_DEFAULT) <= 0) return false;
    }
    return H5Lexists(file_.get(), path.c_str(), H5P_DEFAULT) > 0;
  }
  /// Names of the links directly below a group, sorted; empty if the group is absent.
  [[nodiscard]] std::vector<std::string> children(const std::string& group) const {
    std::vector<std::string> names;
    if (!has(group)) return names;
    const GroupHandle handle(H5Gopen2(file_.get(), group.c_str(), H5P_DEFAULT));
    if (!handle.valid()) fail("group " + group, "is not a group");
    H5Literate(handle.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_name, &names);
    return names;
  }

  /// A one-dimensional dataset of numbers: of triggers, phases, points; no samples.
  [[nodiscard]] std::vector<double> numbers(const std::string& path) const {
    const DatasetHandle dataset = open_dataset(path);
    const size_t rows = length(dataset, path, most_rows);
    charge("dataset " + path, rows * bytes_per_value);
    return read_numbers(dataset, path, rows);
  }
  /// A recording's samples, all of them in memory.
  [[nodiscard]] std::vector<double> samples(const std::string& path) const {
    const DatasetHandle dataset = open_dataset(path);
    const size_t rows = length(dataset, path, most_samples);
    charge("dataset " + path, rows * sizeof(double));
    return read_numbers(dataset, path, rows);
  }
  /// All numbers of a dataset of any shape, the last index running fastest.
  [[nodiscard]] std::vector<double> field(const std::string& path) const {
    const DatasetHandle dataset = open_dataset(path);
    const SpaceHandle space(H5Dget_space(dataset.get()));
    const hssize_t count = H5Sget_simple_extent_npoints(space.get());
    if (count < 0 || static_cast<hsize_t>(count) > most_samples)
      fail("dataset " + path, fmt::format("claims {} numbers", count));
    charge("dataset " + path, static_cast<uint64_t>(count) * sizeof(double));
    return read_numbers(dataset, path, static_cast<size_t>(count));
  }
  /// The same, read when it is asked for; stays readable without this object.
  [[nodiscard]] Series series(const std::string& path) const {
    const auto dataset = std::make_shared<const DatasetHandle>(open_in_chunks(path));
    if (!is_number(TypeHandle(H5Dget_type(dataset->get())))) fail("dataset " + path, "does not hold numbers");
    const size_t rows = length(*dataset, path, most_samples);
    charge("dataset " + path, rows * bytes_per_streamed_row);
    const auto read = [dataset, path, name = name_](size_t first, std::span<double> values) {
      const hsize_t from = first, count = values.size();
      const SpaceHandle stored(H5Dget_space(dataset->get()));
      const SpaceHandle memory(H5Screate_simple(1, &count, nullptr));
      if (H5Sselect_hyperslab(stored.get(), H5S_SELECT_SET, &from, nullptr, &count, nullptr) < 0 ||
          H5Dread(dataset->get(), H5T_NATIVE_DOUBLE, memory.get(), stored.get(), H5P_DEFAULT, values.data()) <
              0) {
        throw InputError({name, "dataset " + path, "cannot be read; the file is damaged", ""});
      }
    };
    return {rows, read};
  }
  /// A dataset that holds one number, or one text.
  [[nodiscard]] double scalar(const std::string& path) const {
    const DatasetHandle dataset = open_dataset(path);
    const SpaceHandle space(H5Dget_space(dataset.get()));
    double value = 0;
    charge("dataset " + path, bytes_per_value);
    if (!is_number(TypeHandle(H5Dget_type(dataset.get()))) ||
        H5Sget_simple_extent_npoints(space.get()) != 1 ||
        H5Dread(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) < 0) {
      fail("dataset " + path, "does not hold one number");
    }
    return value;
  }
  [[nodiscard]] std::string text(const std::string& path) const {
    const DatasetHandle dataset = open_dataset(path);
    const TypeHandle type(H5Dget_type(dataset.get()));
    const SpaceHandle space(H5Dget_space(dataset.get()));
    if (H5Tget_class(type.get()) != H5T_STRING || H5Sget_simple_extent_npoints(space.get()) != 1) {
      fail("dataset " + path, "does not hold one text");
    }
    const auto texts = read_texts(
        "dataset " + path, type, space, 1, unwrapped,
        [&](hid_t memory, void* target) { return read_with_texts(dataset, memory, target, path); });
    if (!texts) fail("dataset " + path, "cannot be read; the file is damaged");
    return texts->front();
  }

  /// All attributes of an object. Those that are neither one number nor one text are left out.
  [[nodiscard]] std::map<std::string, Attribute, std::less<>> attributes(const std::string& object) const {
    const ObjectHandle handle(H5Oopen(file_.get(), object.c_str(), H5P_DEFAULT));
    if (!handle.valid())
      fail("group " + object, "is missing", "A run file must hold it; see docs/run-file.md.");
    std::vector<std::string> names;
    H5Aiterate2(handle.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_attribute, &names);
    std::map<std::string, Attribute, std::less<>> values;
    for (const std::string& name : names) {
      charge("group " + object, bytes_per_value + name.size());
      const AttributeHandle attribute(H5Aopen(handle.get(), name.c_str(), H5P_DEFAULT));
      if (auto value = read_attribute("group " + object, attribute)) values.emplace(name, std::move(*value));
    }
    return values;
  }

  /// One column of a compound table.
  void column(const std::string& table, const std::string& name, std::vector<double>& out) const {
    out = read_column<double>(table, name, H5T_NATIVE_DOUBLE);
  }
  void column(const std::string& table, const std::string& name, std::vector<int64_t>& out) const {
    out = read_column<int64_t>(table, name, H5T_NATIVE_INT64);
  }
  void column(const std::string& table, const std::string& name, std::vector<std::string>& out) const {
    const Column opened = open_column(table, name);
    if (H5Tget_class(opened.type.get()) != H5T_STRING) {
      fail("dataset " + table, fmt::format("column {} does not hold texts", name));
    }
    if (opened.rows == 0) return out.clear();
    const auto one_member = [&](hid_t text) {
      TypeHandle row(H5Tcreate(H5T_COMPOUND, H5Tget_size(text)));
      H5Tinsert(row.get(), name.c_str(), 0, text);
      return row;
    };
    const SpaceHandle space(H5Dget_space(opened.table.get()));
    auto texts = read_texts(
        "dataset " + table, opened.type, space, opened.rows, one_member,
        [&](hid_t memory, void* target) { return read_with_texts(opened.table, memory, target, table); });
    if (!texts) fail("dataset " + table, "cannot be read; the file is damaged");
    out = std::move(*texts);
  }

  [[noreturn]] void fail(const std::string& place, std::string problem, std::string remedy = {}) const {
    throw InputError({name_, place, std::move(problem), std::move(remedy)});
  }
  [[nodiscard]] const std::string& file() const { return name_; }

 private:
  // Larger claims are a damaged header, not a recording: three hours at 10 kHz, and cycles of more than the ten million that a
  // segment may have (host/config/experiment.cpp).
  static constexpr hsize_t most_samples = hsize_t{1} << 27, most_rows = hsize_t{1} << 24;
  /// The library's own choice is a megabyte at most, the daemon's 32 KB.
  static constexpr uint64_t most_chunk_bytes = uint64_t{16} << 20;
  /// All that is read has so many times the bytes of its file, or of three megabytes, at most. Columns that stand still take no room in the
  /// file, and evenly spaced times are packed 20 to 55 times: an hour of ten motionless channels at 1 kHz has 0.3 GB of values.
  static constexpr uint64_t most_expansion = 128, small_file_bytes = uint64_t{3} << 20;
  /// They take time, and memory for two chunks of each column only (open_in_chunks).
  static constexpr uint64_t bytes_per_streamed_row = 1;
  /// Of a trigger, a phase, an attribute, a cell of a table: with the remarks that are made about it.
  static constexpr uint64_t bytes_per_value = 128;
  /// Deflate makes 1032 bytes of one at best (zlib's technical notes), and a chunk of a few bytes has its ends besides.
  static constexpr uint64_t most_inflation = 1100;
  static constexpr const char* tampered =
      "It was damaged or made to do harm; nothing of it was read. Give the file that the daemon wrote.";

  using ReadInto = std::function<bool(hid_t memory_type, void* target)>;

  /// Ends a fixed-length text at its first NUL, and drops the blanks of Fortran-style padding.
  static std::string trimmed(const char* bytes, size_t size, H5T_str_t padding) {
    std::string text(bytes, std::find(bytes, bytes + size, '\0'));
    if (padding == H5T_STR_SPACEPAD) text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }

  /// To be called before memory is taken. A dataset may have any number of links, and a few packed bytes are many zeros: it is the
  /// sum of all reads that must stay within bounds.
  void charge(const std::string& place, uint64_t bytes) const {
    constexpr double MB = 1e6;
    const uint64_t most = most_expansion * std::max(bytes_, small_file_bytes);
    if (bytes > most - charged_bytes_)
      fail(place,
           fmt::format("needs {:.1f} MB of memory with what was read before it, and a file of {:.1f} MB may "
                       "have {:.1f} MB",
                       static_cast<double>(charged_bytes_ + bytes) / MB, static_cast<double>(bytes_) / MB,
                       static_cast<double>(most) / MB),
           tampered);
    charged_bytes_ += bytes;
  }

  /// Reads `count` texts whose stored type is `stored`; `wrap` turns the text type into the type to read with
  /// (itself, or a compound with that one member).
  [[nodiscard]] std::optional<std::vector<std::string>> read_texts(
      const std::string& place, const TypeHandle& stored, const SpaceHandle& space, size_t count,
      const std::function<TypeHandle(hid_t)>& wrap, const ReadInto& read) const {
    std::vector<std::string> texts;
    const TypeHandle memory(H5Tcopy(H5T_C_S1));
    H5Tset_cset(memory.get(), H5Tget_cset(stored.get()));
    if (H5Tis_variable_str(stored.get()) > 0) {
      charge(place, count * bytes_per_value);
      H5Tset_size(memory.get(), H5T_VARIABLE);
      std::vector<char*> pointers(count, nullptr);
      const TypeHandle type = wrap(memory.get());
      if (!read(type.get(), pointers.data())) return std::nullopt;
      uint64_t text_bytes = 0;
      for (const char* pointer : pointers)
        text_bytes += texts.emplace_back(pointer == nullptr ? "" : pointer).size();
      H5Dvlen_reclaim(type.get(), space.get(), H5P_DEFAULT, pointers.data());
      charge(place, text_bytes);
      return texts;
    }
    const size_t size = H5Tget_size(stored.get());
    if (size == 0) return std::nullopt;
    charge(place, count * (bytes_per_value + size));
    H5Tset_size(memory.get(), size);
    H5Tset_strpad(memory.get(), H5Tget_strpad(stored.get()));
    std::vector<char> bytes(count * size);
    if (!read(wrap(memory.get()).get(), bytes.data())) return std::nullopt;
    for (size_t i = 0; i < count; ++i) {
      texts.push_back(trimmed(bytes.data() + i * size, size, H5Tget_strpad(stored.get())));
    }
    return texts;
  }

  static TypeHandle unwrapped(hid_t type) { return TypeHandle(H5Tcopy(type)); }

  static bool is_number(const TypeHandle& type) {
    const H5T_class_t kind = H5Tget_class(type.get());
    return kind == H5T_FLOAT || kind == H5T_INTEGER;
  }

  [[nodiscard]] std::optional<Attribute> read_attribute(const std::string& place,
                                                        const AttributeHandle& attribute) const {
    const TypeHandle type(H5Aget_type(attribute.get()));
    const SpaceHandle space(H5Aget_space(attribute.get()));
    if (H5Sget_simple_extent_npoints(space.get()) != 1 || H5Tget_size(type.get()) > bytes_)
      return std::nullopt;
    const ReadInto read = [&](hid_t memory, void* target) {
      return H5Aread(attribute.get(), memory, target) >= 0;
    };
    switch (H5Tget_class(type.get())) {
      case H5T_INTEGER: {
        int64_t value = 0;
        return read(H5T_NATIVE_INT64, &value) ? std::optional<Attribute>(value) : std::nullopt;
      }
      case H5T_FLOAT: {
        double value = 0;
        return read(H5T_NATIVE_DOUBLE, &value) ? std::optional<Attribute>(value) : std::nullopt;
      }
      case H5T_STRING: {
        auto texts = read_texts(place, type, space, 1, unwrapped, read);
        return texts ? std::optional<Attribute>(std::move(texts->front())) : std::nullopt;
      }
      default:
        return std::nullopt;
    }
  }

  static herr_t collect_name(hid_t, const char* name, const H5L_info_t*, void* names) {
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
    return 0;
  }

  static herr_t collect_attribute(hid_t, const char* name, const H5A_info_t*, void* names) {
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
    return 0;
  }

  /// The library would keep megabytes of the index of an hour's chunks, which are read one after the other, and each once.
  static PropertyHandle with_small_cache() {
    constexpr size_t cache_bytes = size_t{128}
                                   << 10;  // nodes of a dozen datasets' indices, read side by side
    PropertyHandle access(H5Pcreate(H5P_FILE_ACCESS));
    H5AC_cache_config_t cache{};
    cache.version = H5AC__CURR_CACHE_CONFIG_VERSION;
    H5Pget_mdc_config(access.get(), &cache);
    cache.set_initial_size = true;
    cache.initial_size = cache.min_size = cache.max_size = cache_bytes;
    cache.incr_mode = H5C_incr__off;
    cache.flash_incr_mode = H5C_flash_incr__off;
    cache.decr_mode = H5C_decr__off;
    H5Pset_mdc_config(access.get(), &cache);
    return access;
  }

  /// Hard and soft links only: an external one, or one of a class of its own, leads to what another file or a plug-in says.
  void expect_own_links() const {
    std::string foreign;
    const auto look = [](hid_t, const char* name, const H5L_info_t* link, void* found) -> herr_t {
      if (link->type == H5L_TYPE_HARD || link->type == H5L_TYPE_SOFT) return 0;
      *static_cast<std::string*>(found) = name;
      return 1;
    };
    const herr_t ended = H5Lvisit(file_.get(), H5_INDEX_NAME, H5_ITER_NATIVE, look, &foreign);
    if (ended > 0) fail("link /" + foreign, "leads out of the file, which no run file's does", tampered);
    if (ended < 0) fail("", "has groups that cannot be read; the file is damaged");
  }
  /// The values lie in this file, and are no more than its bytes can hold.
  void expect_own_values(const DatasetHandle& dataset, const std::string& path) const {
    const PropertyHandle made(H5Dget_create_plist(dataset.get()));
    const H5D_layout_t layout = H5Pget_layout(made.get());
    if (layout == H5D_VIRTUAL || H5Pget_external_count(made.get()) > 0)
      fail("dataset " + path, "takes its values from another file, which no run file's does", tampered);
    const TypeHandle type(H5Dget_type(dataset.get()));
    const SpaceHandle space(H5Dget_space(dataset.get()));
    const auto values =
        static_cast<uint64_t>(std::max<hssize_t>(H5Sget_simple_extent_npoints(space.get()), 0));
    const uint64_t value_bytes = std::max<uint64_t>(H5Tget_size(type.get()), 1);
    const uint64_t stored_bytes = std::min<uint64_t>(H5Dget_storage_size(dataset.get()), bytes_);
    const uint64_t most_bytes =
        H5Pget_nfilters(made.get()) > 0 ? most_inflation * stored_bytes : stored_bytes;
    if (values > most_bytes / value_bytes)
      fail("dataset " + path,
           fmt::format("claims {} values of {} bytes each, and the file holds {} bytes of them", values,
                       value_bytes, stored_bytes),
           tampered);
    std::array<hsize_t, H5S_MAX_RANK> chunk{};
    const int ranks = layout == H5D_CHUNKED ? H5Pget_chunk(made.get(), H5S_MAX_RANK, chunk.data()) : 0;
    uint64_t chunk_bytes = ranks > 0 && H5Pget_nfilters(made.get()) > 0 ? value_bytes : 0;
    for (int i = 0; i < ranks; ++i)  // a chunk has less than 2^32 values, by its format
      chunk_bytes *= chunk[static_cast<size_t>(i)];
    if (chunk_bytes > most_chunk_bytes)
      fail("dataset " + path, fmt::format("is packed in chunks of {} bytes", chunk_bytes),
           "Pack it in chunks of a megabyte or less: h5repack -l CHUNK=131072.");
  }
  [[nodiscard]] std::vector<double> read_numbers(const DatasetHandle& dataset, const std::string& path,
                                                 size_t count) const {
    if (!is_number(TypeHandle(H5Dget_type(dataset.get())))) fail("dataset " + path, "does not hold numbers");
    std::vector<double> values(count);
    if (!values.empty() &&
        H5Dread(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
      fail("dataset " + path, "cannot be read; the file is damaged");
    }
    return values;
  }
  /// Memory for texts of variable length. They are stored without compression: together they take no more of it than the file has
  /// bytes, unless many rows share one.
  struct TextMemory {
    uint64_t left = 0;
    bool exhausted = false;
    std::vector<void*> allocated = {};

    static void* take(size_t bytes, void* self) {
      auto& memory = *static_cast<TextMemory*>(self);
      memory.exhausted |= bytes > memory.left;
      if (memory.exhausted) return nullptr;
      memory.left -= bytes;
      memory.allocated.push_back(std::malloc(bytes));
      return memory.allocated.back();
    }
    static void give(void* bytes, void* self) {
      std::erase(static_cast<TextMemory*>(self)->allocated, bytes);
      std::free(bytes);
    }
  };
  /// False if the values cannot be read. What is read with it belongs to the caller, as after H5Dread.
  [[nodiscard]] bool read_with_texts(const DatasetHandle& dataset, hid_t memory_type, void* target,
                                     const std::string& path) const {
    TextMemory memory{.left = bytes_};
    const PropertyHandle transfer = buffered_for(dataset);
    H5Pset_vlen_mem_manager(transfer.get(), TextMemory::take, &memory, TextMemory::give, &memory);
    if (H5Dread(dataset.get(), memory_type, H5S_ALL, H5S_ALL, transfer.get(), target) >= 0) return true;
    for (void* each : memory.allocated)
      std::free(each);
    if (memory.exhausted)
      fail("dataset " + path, fmt::format("has texts of more than the {} bytes of its file", bytes_),
           tampered);
    return false;
  }

  struct Column {
    DatasetHandle table;
    TypeHandle type;  // the member's
    size_t rows = 0;
  };
  [[nodiscard]] DatasetHandle open_dataset(const std::string& path) const {
    if (!has(path)) fail("dataset " + path, "is missing", "A run file must hold it; see docs/run-file.md.");
    DatasetHandle dataset(H5Dopen2(file_.get(), path.c_str(), H5P_DEFAULT));
    if (!dataset.valid()) fail(path, "is not a dataset");
    expect_own_values(dataset, path);
    return dataset;
  }
  /// With a cache of two chunks, so that one is unpacked once by whoever reads on.
  [[nodiscard]] DatasetHandle open_in_chunks(const std::string& path) const {
    DatasetHandle dataset = open_dataset(path);
    const PropertyHandle made(H5Dget_create_plist(dataset.get()));
    hsize_t rows = 0;
    if (H5Pget_layout(made.get()) != H5D_CHUNKED || H5Pget_chunk(made.get(), 1, &rows) != 1) return dataset;
    const TypeHandle type(H5Dget_type(dataset.get()));
    constexpr size_t slots = 13;  // a prime, as the library asks
    const PropertyHandle access(H5Pcreate(H5P_DATASET_ACCESS));
    dataset = DatasetHandle();  // one that is open would keep its cache
    const size_t cache_bytes = 2 * static_cast<size_t>(rows) * H5Tget_size(type.get());
    charge("dataset " + path, cache_bytes);
    H5Pset_chunk_cache(access.get(), slots, cache_bytes, 1);
    return DatasetHandle(H5Dopen2(file_.get(), path.c_str(), access.get()));
  }
  [[nodiscard]] size_t length(const DatasetHandle& dataset, const std::string& path, hsize_t most) const {
    const SpaceHandle space(H5Dget_space(dataset.get()));
    hsize_t rows = 0;
    if (H5Sget_simple_extent_ndims(space.get()) != 1) fail("dataset " + path, "is not one-dimensional");
    H5Sget_simple_extent_dims(space.get(), &rows, nullptr);
    if (rows > most)
      fail("dataset " + path, fmt::format("claims {} rows, and up to {} are read", rows, most), tampered);
    return static_cast<size_t>(rows);
  }
  /// To convert rows HDF5 allocates and clears a buffer of a megabyte, each time, unless it is given a smaller size: more work than
  /// the rest of a small table. It enlarges a buffer that does not hold a row.
  static PropertyHandle buffered_for(const DatasetHandle& table) {
    constexpr hsize_t usual_bytes = hsize_t{1} << 20;
    PropertyHandle transfer(H5Pcreate(H5P_DATASET_XFER));
    const TypeHandle row(H5Dget_type(table.get()));
    const SpaceHandle space(H5Dget_space(table.get()));
    const auto rows = static_cast<hsize_t>(std::max<hssize_t>(1, H5Sget_simple_extent_npoints(space.get())));
    // A text of variable length takes 16 bytes there, of which its type owns to 8.
    const hsize_t row_bytes = 2 * std::max<hsize_t>(1, H5Tget_size(row.get()));
    if (rows < usual_bytes / row_bytes)
      H5Pset_buffer(transfer.get(), static_cast<size_t>(rows * row_bytes), nullptr, nullptr);
    return transfer;
  }
  [[nodiscard]] Column open_column(const std::string& table, const std::string& column) const {
    Column opened{open_dataset(table), {}, 0};
    const TypeHandle row(H5Dget_type(opened.table.get()));
    if (H5Tget_class(row.get()) != H5T_COMPOUND) fail("dataset " + table, "is not a compound table");
    const int member = H5Tget_member_index(row.get(), column.c_str());
    if (member < 0) fail("dataset " + table, fmt::format("has no column {}", column));
    opened.type = TypeHandle(H5Tget_member_type(row.get(), static_cast<unsigned>(member)));
    opened.rows = length(opened.table, table, most_rows);
    return opened;
  }
  template <typename Number>
  [[nodiscard]] std::vector<Number> read_column(const std::string& table, const std::string& column,
                                                hid_t memory_type) const {
    const Column opened = open_column(table, column);
    if (!is_number(opened.type))
      fail("dataset " + table, fmt::format("column {} does not hold numbers", column));
    charge("dataset " + table, opened.rows * bytes_per_value);
    std::vector<Number> values(opened.rows);
    if (values.empty()) return values;
    const TypeHandle row(H5Tcreate(H5T_COMPOUND, sizeof(Number)));
    H5Tinsert(row.get(), column.c_str(), 0, memory_type);
    const PropertyHandle transfer = buffered_for(opened.table);
    if (H5Dread(opened.table.get(), row.get(), H5S_ALL, H5S_ALL, transfer.get(), values.data()) < 0) {
      fail("dataset " + table, "cannot be read; the file is damaged");
    }
    return values;
  }

  std::string name_;
  FileHandle file_;
  uint64_t bytes_ = 0;                  ///< of the file
  mutable uint64_t charged_bytes_ = 0;  ///< of all that was read of it
};

}  // namespace diastole::runfile
