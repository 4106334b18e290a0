"""Tables of the commands: whole words and at most 100 columns, whatever they contain."""

from planarfriction.cli.console import print_table


def test_a_wide_table_goes_on_in_another_one(capsys):
    """Each value stands in one piece, beside the name of its row."""
    headings = ["scene", *(f"quantity {k} [mm]" for k in range(30))]
    rows = [[name, *(f"{k}.2345e-12" for k in range(30))] for name in ("a", "b")]
    print_table("Title", headings, rows)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    printed = [
        cell.strip()
        for line in lines
        for cell in line.split("\N{BOX DRAWINGS LIGHT VERTICAL}")
    ]
    for k in range(30):
        assert printed.count(f"{k}.2345e-12") == 2
    assert printed.count("a") == printed.count("b") > 1


def test_a_table_that_fits_is_one(capsys):
    print_table("Title", ["", "value"], [["a", "1.5"]])
    assert capsys.readouterr().out.count("Title") == 1
