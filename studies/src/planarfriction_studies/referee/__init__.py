"""The referee: exact cases of contact friction, the engines that they judge, and tables and files of results."""
