"""Answers as CSV: what stands in a cell where a number is missing."""

import math
from types import SimpleNamespace

from kinetostat.views.data_forms import columns_csv, csv_of
from kinetostat.views.question import Description, Field, Records

RECORDS = Description("rows", (Records("rows", "number", (Field("size"), Field("by_axis"))),))


def test_a_number_that_is_not_known_is_an_empty_cell_in_both_forms_of_csv():
    row = SimpleNamespace(size=math.nan, by_axis={"x": math.nan, "y": 2.0, "z": math.inf})
    answer = SimpleNamespace(rows=[row])
    assert csv_of(RECORDS, answer) == "number,size,by_axis_x,by_axis_y,by_axis_z\n1,,,2.0,inf\n"
    assert columns_csv({"size": [math.nan], "y": [2.0], "z": [math.inf]}) == "size,y,z\n,2.0,inf\n"
