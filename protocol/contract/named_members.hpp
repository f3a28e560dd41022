#pragma once
// Members of a record under their own names, for the braces of a JSON object:
//
//   json object{{"run", file}, DIASTOLE_NAMED(bin, mean_kPa, sd_kPa)};  // {"mean_kPa", bin.mean_kPa}, ...

#include <boost/preprocessor/punctuation/comma_if.hpp>
#include <boost/preprocessor/seq/for_each_i.hpp>
#include <boost/preprocessor/stringize.hpp>
#include <boost/preprocessor/variadic/to_seq.hpp>

#define DIASTOLE_NAMED_ONE(r, record, i, member) \
  BOOST_PP_COMMA_IF(i) { BOOST_PP_STRINGIZE(member), (record).member }
#define DIASTOLE_NAMED(record, ...) \
  BOOST_PP_SEQ_FOR_EACH_I(DIASTOLE_NAMED_ONE, record, BOOST_PP_VARIADIC_TO_SEQ(__VA_ARGS__))
