unit -1
