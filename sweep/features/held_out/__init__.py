"""Separations on each light that a search leaves out."""

LEFT_OUT = "leave_one_out.parquet"
FILES = {
    LEFT_OUT: "where each light is left out of a search in turn: the objective (of a worst case the nominal "
    "quantity, too), signal_type, signal, the optimum that was `seen`, the same design `with_it`, and the `fall`",
}
