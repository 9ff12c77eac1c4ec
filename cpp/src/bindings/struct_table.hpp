// A struct in Python, from one table of its fields: name, member, and meaning with unit. The properties, the
// constructor with its defaults, their docstrings and the type stub derive from it.
#pragma once

#include <tuple>
#include <type_traits>
#include <utility>

#include "bindings.hpp"

namespace stepdiag::bindings {

// The value that a word of Python stands for; specialised for those that constructors take. Throws InvalidArgument.
template <class Value>
Value parsed(const std::string& word);

// How the value of a field is taken from an argument (from), given back (of), and is a default (usual). This: as
// pybind11 converts it.
template <class Value, class = void>
struct InPython {
    static constexpr bool is_plain = true;
    using Argument = Value;
    static const Value& from(const Value& given, const char*) { return given; }
    static const Value& of(const Value& value) { return value; }
    static const Value& usual(const Value& value) { return value; }
};

// Whole numbers of any size, checked; of 64 bits they are seeds.
template <>
struct InPython<int> {
    static constexpr bool is_plain = true;
    using Argument = IntegerLike;
    static int from(const IntegerLike& given, const char* name) { return to_int(given, name); }
    static int of(int value) { return value; }
    static IntegerLike usual(int value) { return integer(value); }
};
template <>
struct InPython<std::uint64_t> {
    static constexpr bool is_plain = true;
    using Argument = IntegerLike;
    static std::uint64_t from(const IntegerLike& given, const char*) { return to_seed(given); }
    static std::uint64_t of(std::uint64_t value) { return value; }
    static IntegerLike usual(std::uint64_t value) { return integer(int(value)); }
};

// Arrays of NumPy.
template <int rows, int columns, int options>
struct InPython<Eigen::Matrix<double, rows, columns, options>> {
    using Matrix = Eigen::Matrix<double, rows, columns, options>;
    static constexpr bool is_plain = false;
    using Argument = ArrayLike;
    static Matrix from(const ArrayLike& given, const char* name) {
        if constexpr (columns != 1) return to_matrix(given, name);
        else if constexpr (rows == 3) return to_vector3(given, name);
        else if constexpr (rows == 2) return to_vector2(given, name);
        else return to_vector(given, name);
    }
    static DoubleArray of(const Matrix& value) {
        if constexpr (columns == 1) return to_numpy_vector(value);
        else return to_numpy(Eigen::MatrixXd(value));
    }
    static ArrayLike usual(const Matrix& value) {
        py::tuple numbers(value.size());
        for (Eigen::Index i = 0; i < value.size(); ++i) numbers[std::size_t(i)] = value.data()[i];
        return py::reinterpret_borrow<ArrayLike>(numbers);
    }
};

// What has a word for each value.
template <class Value>
struct AsWord {
    static constexpr bool is_plain = false;
    using Argument = std::string;
    static Value from(const std::string& given, const char*) { return parsed<Value>(given); }
    static std::string of(const Value& value) { return name(value); }
    static std::string usual(const Value& value) { return name(value); }
};
template <class Enum>
struct InPython<Enum, std::enable_if_t<std::is_enum_v<Enum>>> : AsWord<Enum> {};

template <class Value>
struct InPython<std::optional<Value>> {
    using Inner = InPython<Value>;
    static constexpr bool is_plain = Inner::is_plain;
    using Argument = std::optional<typename Inner::Argument>;
    static std::optional<Value> from(const Argument& given, const char* name) {
        return given ? std::optional<Value>(Inner::from(*given, name)) : std::nullopt;
    }
    static auto of(const std::optional<Value>& value) {
        using Given = std::decay_t<decltype(Inner::of(*value))>;
        return value ? std::optional<Given>(Inner::of(*value)) : std::nullopt;
    }
    static Argument usual(const std::optional<Value>& value) {
        return value ? Argument(Inner::usual(*value)) : std::nullopt;
    }
};

template <class T, class Value, bool required = false>
struct Field {
    using Argument = typename InPython<Value>::Argument;
    const char* name;
    Value T::* member;
    const char* doc;
};
template <class T, class Value>
Field<T, Value> field(const char* name, Value T::* member, const char* doc = "") {
    return {name, member, doc};
}
// One that has no default.
template <class T, class Value>
Field<T, Value, true> required(const char* name, Value T::* member, const char* doc = "") {
    return {name, member, doc};
}

template <class Class, class T, class Value, bool is_required>
void add_property(Class& bound, const Field<T, Value, is_required>& field) {
    if constexpr (InPython<Value>::is_plain) bound.def_readonly(field.name, field.member, field.doc);
    else
        bound.def_property_readonly(
            field.name, [member = field.member](const T& value) { return InPython<Value>::of(value.*member); },
            field.doc);
}
// Of a class that has more than its fields; T may be derived from theirs.
template <class T, class... Fields>
py::class_<T> add_properties(py::class_<T> bound, const Fields&... fields) {
    (add_property(bound, fields), ...);
    return bound;
}

// A struct that functions return: its fields are read-only properties.
template <class T, class... Values>
py::class_<T> bind_record(py::module_& m, const char* name, const char* doc, const Field<T, Values>&... fields) {
    return add_properties(py::class_<T>(m, name, doc), fields...);
}

template <class T, class Value, bool is_required>
auto argument(const Field<T, Value, is_required>& field, const T& usual) {
    if constexpr (is_required) return py::arg(field.name);
    else return py::arg(field.name) = InPython<Value>::usual(usual.*field.member);
}

template <class T, class... Fields, std::size_t... first, std::size_t... other>
void add_constructor(py::class_<T>& bound, void (*check)(const T&), const std::tuple<Fields...>& fields,
                     std::index_sequence<first...>, std::index_sequence<other...>) {
    std::string doc = check ? "Raises InvalidArgument for what makes no sense.\n" : "";
    std::apply([&](const Fields&... each) { ((doc += std::string("\n") + each.name + ": " + each.doc), ...); }, fields);
    const T usual{};
    bound.def(
        py::init([fields, check](const typename Fields::Argument&... given) {
            T made{};
            const auto take = [&](const Fields&... each) {
                ((made.*each.member = InPython<std::decay_t<decltype(made.*each.member)>>::from(given, each.name)),
                 ...);
            };
            std::apply(take, fields);
            if (check) check(made);
            return made;
        }),
        argument(std::get<first>(fields), usual)..., py::kw_only(),
        argument(std::get<sizeof...(first) + other>(fields), usual)..., doc.c_str());
}

// A struct that Python makes: its first arguments by position or name, the others by name. check throws
// InvalidArgument; none: functions that take the struct check it.
template <class T, std::size_t by_position = 0, class... Fields>
py::class_<T> bind_options(py::module_& m, const char* name, const char* doc, void (*check)(const T&),
                           const Fields&... fields) {
    py::class_<T> bound(m, name, doc);
    add_constructor(bound, check, std::tuple(fields...), std::make_index_sequence<by_position>(),
                    std::make_index_sequence<sizeof...(Fields) - by_position>());
    return add_properties(bound, fields...);
}

}  // namespace stepdiag::bindings
