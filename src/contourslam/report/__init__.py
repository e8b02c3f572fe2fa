"""What a run or a comparison leaves behind: map files, tables, figures, the page.

``result_folder`` writes and reads the folder of a run, ``html`` writes the report of a comparison. Map files and tables
need the core only; figures and the page need the extra ``report``.
"""
